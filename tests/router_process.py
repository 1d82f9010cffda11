"""A zenoh router in a process of its own, which can be stopped, killed and started again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from types import TracebackType
from typing import Self

_ROUTER = """
import sys
import zenoh
from covista_schemas.zenoh_config import config

with zenoh.open(config("router", listen=[sys.argv[1]])):
    print("open", flush=True)
    sys.stdin.read()
"""


class RouterProcess:
    """The router at one end point; within the block it runs, and is killed at its end."""

    def __init__(self, endpoint: str) -> None:
        self.endpoint = endpoint
        self.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    def start(self) -> None:
        """Returns when the router listens."""
        self._process = subprocess.Popen(
            [sys.executable, "-c", _ROUTER, self.endpoint], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "open\n"

    def stop(self) -> None:
        """Have it do nothing any more: what is sent to it stays in the kernel, and is lost if it is killed then."""
        self._process.send_signal(signal.SIGSTOP)
        # Its threads go on until one of them has taken the signal, which takes a while on a busy machine.
        os.waitid(os.P_PID, self._process.pid, os.WSTOPPED | os.WNOWAIT)

    def kill(self) -> None:
        """End it without a word."""
        self._process.kill()
        self._process.communicate()

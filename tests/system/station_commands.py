"""`covista-station` as processes, without the variables of whoever runs the tests."""

import os
import subprocess
import sys
from pathlib import Path

from tests.service.deadline import free_endpoint

COMMAND = [sys.executable, "-m", "covista_service"]


def environment(**variables: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("COVISTA_")}
    return kept | variables


def command(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run to the end."""
    return subprocess.run(
        [*COMMAND, *words], cwd=folder, env=environment(**variables), capture_output=True, text=True, timeout=60
    )


def token(folder: Path, *words: str, **variables: str) -> str:
    """What `token` says on stdout, where it does what it is told."""
    done = command(folder, "token", *words, **variables)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def serve(folder: Path, *flags: str, **variables: str) -> "subprocess.Popen[str]":
    """A station's process."""
    return subprocess.Popen(
        [*COMMAND, "serve", "--api", "127.0.0.1:0", "--link", free_endpoint(), *flags],
        cwd=folder,
        env=environment(**variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )

"""What zenoh says itself, as lines of our log: only there is told that somebody's certificate was refused.

Zenoh writes to the process's standard output. A pipe takes that place, and what Python prints goes out as before.
"""

from __future__ import annotations

import logging
import os
import re
import sys
import threading
from collections import Counter

import zenoh

from covista_service.telemetry import about

HANDSHAKE = "handshake"
_LINE = re.compile(
    r"(?P<time>\d{4}-\S+Z)\s+(?P<level>[A-Z]+)\s+(?:.*?ThreadId\(\d+\)\s+)?(?P<where>[\w:]+): (?P<said>.*)"
)
# A guess of zenoh's at what is wrong, and places of its own source code.
_NOISE = re.compile(r"\. Hint: increase the system open file limit\.| at /\S+")
_LEVELS = {"ERROR": logging.ERROR, "WARN": logging.WARNING}

log = logging.getLogger(__name__)
# Of this process, as the log is.
refused: Counter[str] = Counter({HANDSHAKE: 0})


def follow_zenoh_log() -> None:
    """Have zenoh's warnings come into our log from now on; once a process, by who owns its standard output.

    Where RUST_LOG asks for more, zenoh writes that to standard output itself.
    """
    if "RUST_LOG" in os.environ:
        zenoh.try_init_log_from_env()
        return
    sys.stdout.flush()
    kept = os.dup(1)
    sys.stdout = os.fdopen(kept, "w", buffering=1, encoding="utf-8", errors="backslashreplace")
    source, sink = os.pipe()
    os.dup2(sink, 1)
    os.close(sink)
    os.environ["NO_COLOR"] = "1"
    zenoh.init_log_from_env_or("warn")
    threading.Thread(target=_follow, args=(source, kept), name="covista-zenoh-log", daemon=True).start()


def take(line: str) -> bool:
    """Log a line of zenoh's, and count it where it tells of a refusal; False if it is none of zenoh's."""
    found = _LINE.match(line)
    if found is None:
        return False
    said, where = _NOISE.sub("", found["said"]), found["where"]
    if where.startswith("zenoh_link_tls"):
        refused[HANDSHAKE] += 1
        log.warning("somebody who connects is refused, or refuses us", extra=about(said=said))
    else:
        log.log(_LEVELS.get(found["level"], logging.INFO), "zenoh says", extra=about(said=said, where=where))
    return True


def _follow(source: int, kept: int) -> None:
    with os.fdopen(source, "r", encoding="utf-8", errors="backslashreplace") as lines:
        for line in lines:
            if not take(line.rstrip()):
                os.write(kept, line.encode())

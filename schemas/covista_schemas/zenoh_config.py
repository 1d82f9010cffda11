"""Zenoh configurations that robots and station open their sessions with.

Scouting is off and end points are explicit; shared memory is off, since it bypasses the limit on message sizes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Literal

import zenoh

from covista_schemas.errors import LinkError

MAX_MESSAGE_BYTES = 4 * 1024 * 1024
# A dead link is noticed after some 1.6 s, not 10 s.
LEASE_MS = 2000


def config(
    mode: Literal["client", "router"],
    *,
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    timeout_ms: int = 1000,
) -> zenoh.Config:
    """Configuration of a session; `connect` and `listen` are end points such as tcp/127.0.0.1:7447.

    A client that finds no router within `timeout_ms` fails to open. Raises LinkError for end points that zenoh refuses.
    """
    made = zenoh.Config()
    values: dict[str, object] = {
        "mode": mode,
        "connect/endpoints": list(connect),
        "connect/timeout_ms": timeout_ms,
        "connect/exit_on_failure": mode == "client",
        "listen/endpoints": list(listen),
        "listen/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        "timestamping/enabled": True,
    }
    for key, value in values.items():
        try:
            made.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise LinkError(f"zenoh refuses {key} = {value!r}: {error}") from error
    return made

"""The rovers of a swarm, connected."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import Literal

import zenoh
from covista_schemas import zenoh_config
from covista_schemas.messages import Camera

from covista_clients.rover import Rover

Sending = Literal["image", "features", "features+thumbnail"]
# Larger fleets share one session, as robots behind one radio would.
_SESSIONS = 16
_RETRY_S = 0.5


@contextmanager
def fleet(
    names: Sequence[str], camera: Camera, connect: str, site: str, send: Sending, stop: threading.Event
) -> Iterator[list[Rover]]:
    """Rovers that connect on their own; they close side by side, as each may wait for the station's confirmation.

    A large fleet waits for a router first, and is empty if `stop` is set before there is one.
    """
    with ExitStack() as stack:
        session = None
        if len(names) > _SESSIONS:
            session = shared_session(connect, stop, stack)
            if session is None:
                yield []
                return
        pool = stack.enter_context(ThreadPoolExecutor(_SESSIONS, "rovers"))
        rovers: list[Rover] = []
        stack.callback(lambda: list(pool.map(Rover.close, rovers)))
        rovers.extend(Rover(name, camera, connect, site=site, send=send, session=session) for name in names)
        yield rovers


def shared_session(connect: str, stop: threading.Event, stack: ExitStack) -> zenoh.Session | None:
    """A session that closes with `stack`, as soon as there is a router; None once `stop` is set."""
    config = zenoh_config.config("client", connect=[connect])
    for _ in itertools.count():
        try:
            return stack.enter_context(zenoh.open(config))
        except zenoh.ZError:
            if stop.wait(_RETRY_S):
                break
    return None

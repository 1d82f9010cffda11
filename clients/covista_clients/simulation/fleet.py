"""The rovers of a swarm, connected."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import Literal

import zenoh
from covista_schemas.errors import LinkError
from covista_schemas.messages import Camera
from covista_schemas.zenoh_tls import Tls

from covista_clients.rover import Rover
from covista_clients.rover.link import open_with_retry

Sending = Literal["image", "features", "features+thumbnail"]
# Larger fleets share one session, as robots behind one radio would.
_SESSIONS = 16


@contextmanager
def fleet(
    names: Sequence[str],
    camera: Camera,
    connect: str,
    site: str,
    send: Sending,
    stop: threading.Event,
    tls: Tls | None = None,
) -> Iterator[list[Rover]]:
    """Rovers that connect on their own; they close side by side, as each may wait for the station's confirmation.

    A large fleet shares a session, unless certificates are each robot's own (`Tls.of`): it waits for a router first,
    and is empty if `stop` is set before there is one.
    """
    with ExitStack() as stack:
        session = None
        if len(names) > _SESSIONS and not (tls and tls.is_of_each):
            session = shared_session(connect, stop, stack, tls)
            if session is None:
                yield []
                return
        pool = stack.enter_context(ThreadPoolExecutor(_SESSIONS, "rovers"))
        rovers: list[Rover] = []
        stack.callback(lambda: list(pool.map(Rover.close, rovers)))
        for name in names:
            own = None if tls is None else tls.of(name)
            rovers.append(Rover(name, camera, connect, site=site, send=send, session=session, tls=own))
        yield rovers


def shared_session(
    connect: str, stop: threading.Event, stack: ExitStack, tls: Tls | None = None
) -> zenoh.Session | None:
    """A session that closes with `stack`, as soon as there is a router; None once `stop` is set.

    Raises LinkError for certificates that are of no use, or each robot's own.
    """
    if tls is not None:
        if tls.is_of_each:
            raise LinkError("robots that share a session need one certificate that may speak for all, not one each")
        tls.common_name()
    session = open_with_retry(connect, stop, tls)
    return None if session is None else stack.enter_context(session)

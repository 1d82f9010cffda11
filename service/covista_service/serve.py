"""Runs the station in this process until it is told to stop: by a signal, or by `Running.stop`."""

from __future__ import annotations

import asyncio
import errno
import gc
import logging
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, cast

import uvicorn
from covista_schemas.errors import CovistaError
from fastapi import FastAPI
from starlette.types import Receive, Scope, Send

from covista_service import heaps
from covista_service.access.certificates import Certificates
from covista_service.api.connection import Connection
from covista_service.api.deps import Parts
from covista_service.app import create_app
from covista_service.config import Address, Settings
from covista_service.telemetry import Summary

# Answers under way get so long to be finished.
_GRACE_S = 1
# How often the certificate's files are looked at.
_CERTIFICATE_S = 10.0
# A start that takes longer is one that compiles.
_LOOK_S, _PATIENCE_S = 0.2, 5.0
# How long a thread may keep Python to itself while another waits: 5 ms are noticed where many ask.
_SWITCH_S = 0.0005
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_SOCKET_BYTES = 64 * 1024

log = logging.getLogger(__name__)


class StartError(CovistaError):
    """The station cannot start; the text is one line that says what to change."""


@dataclass(frozen=True, slots=True)
class Running:
    """A station that listens: `url` of its API, end points of its zenoh link. `stop` may be called in any thread."""

    url: str
    link: tuple[str, ...]
    summary: Callable[[], Summary]
    stop: Callable[[], None]


def run(settings: Settings, *, ready: Callable[[Running], None] | None = None, signals: bool = True) -> None:
    """Run until stopped; `ready` is called once the station listens. Raises CovistaError where it cannot start.

    In the main thread SIGINT and SIGTERM stop it too, unless `signals` is False.
    """
    heaps.bound()
    app = create_app(settings)
    certificates = _certificates(settings)
    listener = _bind(settings.api_address)
    sys.setswitchinterval(_SWITCH_S)
    try:
        asyncio.run(_serve(app, settings, listener, certificates, ready, signals=signals))
    finally:
        listener.close()


async def _serve(
    app: FastAPI,
    settings: Settings,
    listener: socket.socket,
    certificates: Certificates | None,
    ready: Callable[[Running], None] | None,
    *,
    signals: bool,
) -> None:
    state: Mapping[str, Any] | None = None

    async def stateful(scope: Scope, receive: Receive, send: Send) -> None:
        scope["state"] = dict(state or {})
        await app(scope, receive, send)

    def connection(**given: Any) -> Connection:
        parts: Parts = (state or {})["parts"]
        return Connection(**given, given_up=parts.outgoing.given_up, listening=lambda: parts.stream.listeners)

    def renew_link() -> None:
        if state is not None:
            state["parts"].renew()

    server = _server(stateful, connection, certificates)
    # The lifespan is entered here and not by the server, so that what goes wrong comes out as an exception.
    heard = _SIGNALS if signals else ()
    renews: list[Callable[[], object]] = [] if certificates is None else [certificates.renew]
    if settings.zenoh_tls is not None:
        renews.append(renew_link)
    with _stopped_by(heard, server.stop), _renewed(certificates, renews, signals=signals):
        async with app.router.lifespan_context(app) as state:
            if state is None:
                raise StartError("the application has no parts")
            parts: Parts = state["parts"]
            running = Running(_url(settings, listener), settings.link, parts.telemetry.summary, server.stop)
            server.when_started = (lambda: ready(running)) if ready else _nothing
            server.when_stopping = parts.stream.close
            beside = [
                asyncio.create_task(_settle(parts), name="covista-settling"),
                asyncio.create_task(heaps.keep_trim(), name="covista-heaps"),
            ]
            try:
                await server.serve([listener])
            finally:
                for task in beside:
                    task.cancel()


def _server(stateful: Any, connection: Callable[..., Connection], certificates: Certificates | None) -> _Server:
    """The server of one application; it speaks TLS where there is a certificate."""
    server = _Server(
        uvicorn.Config(
            stateful,
            # Called for each connection like the class that it stands for.
            http=cast(type[asyncio.Protocol], connection),
            lifespan="off",
            log_config=None,
            access_log=False,
            ws="websockets-sansio" if find_spec("websockets") else "none",
            # A browser has no more to say than which page it looks at.
            ws_max_size=_SOCKET_BYTES,
            # Whoever asks could write them: an address is that of the connection.
            proxy_headers=False,
            server_header=False,
            ssl_context_factory=None if certificates is None else lambda _config, _usual: certificates.context,
            timeout_graceful_shutdown=_GRACE_S,
        )
    )
    # Now, for NiceGUI looks as it starts through all servers that there are for its own.
    server.config.load()
    return server


async def _settle(parts: Parts) -> None:
    """Once all that stays is loaded, leave it alone: a collector that looks through it holds up everybody's answer."""
    begun_s, told = time.monotonic(), False
    while parts.health().status == "starting":
        await asyncio.sleep(_LOOK_S)
        if not told and time.monotonic() - begun_s > _PATIENCE_S:
            told = True
            log.info("loads compiled code; what is not there yet is compiled, which takes a minute or two")
    gc.collect()
    gc.freeze()
    log.info("ready")


class _Server(uvicorn.Server):
    """Uvicorn's server, that leaves signals to us and says when it listens and when it stops."""

    when_started: Callable[[], None]
    when_stopping: Callable[[], None]

    def stop(self) -> None:
        """Stop soon; at once when told twice."""
        self.force_exit = self.should_exit
        self.should_exit = True

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self.when_started()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        # What has no end by itself would keep the server waiting.
        self.when_stopping()
        await super().shutdown(sockets)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


@contextmanager
def _stopped_by(signals: Sequence[signal.Signals], stop: Callable[[], None]) -> Iterator[None]:
    """Have signals stop the server, also where a shell had them ignored; other threads hear none."""
    loop = asyncio.get_running_loop()
    heard = signals if threading.current_thread() is threading.main_thread() else ()
    for number in heard:
        loop.add_signal_handler(number, stop)
    try:
        yield
    finally:
        for number in heard:
            loop.remove_signal_handler(number)


def _certificates(settings: Settings) -> Certificates | None:
    """The certificate to show, if there is to be TLS. Raises CertificateError."""
    if settings.tls_cert is None or settings.tls_key is None:
        return None
    return Certificates(settings.tls_cert, settings.tls_key)


@contextmanager
def _renewed(
    certificates: Certificates | None, renews: Sequence[Callable[[], object]], *, signals: bool
) -> Iterator[None]:
    """Have the certificate renewed when its files change, and all that `renews` at SIGHUP."""
    loop = asyncio.get_running_loop()
    hears = bool(renews) and signals and threading.current_thread() is threading.main_thread()
    if hears:
        loop.add_signal_handler(signal.SIGHUP, lambda: [renew() for renew in renews])
    task = None if certificates is None else asyncio.create_task(_watch(certificates))
    try:
        yield
    finally:
        if task is not None:
            task.cancel()
        if hears:
            loop.remove_signal_handler(signal.SIGHUP)


async def _watch(certificates: Certificates) -> None:
    while True:
        await asyncio.sleep(_CERTIFICATE_S)
        if await asyncio.to_thread(certificates.is_changed):
            certificates.renew()


def _bind(address: Address) -> socket.socket:
    """A socket that listens at the API's address. Raises StartError."""
    change = "choose another with --api (COVISTA_API)"
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_STREAM)[0]
    except socket.gaierror as error:
        raise StartError(f"cannot listen on {address.host}: {error.strerror}; {change}") from error
    listener = socket.socket(family, kind, protocol)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(place)
        # Two may bind to a port as long as neither listens.
        listener.listen()
    except OSError as error:
        listener.close()
        reason = "is taken" if error.errno == errno.EADDRINUSE else f"cannot be used: {error.strerror}"
        raise StartError(f"API port {address.port} on {address.host} {reason}; {change}") from error
    return listener


def _url(settings: Settings, listener: socket.socket) -> str:
    host = settings.api_address.host
    scheme = "http" if settings.tls_cert is None else "https"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{listener.getsockname()[1]}"


def _nothing() -> None:
    """Nobody waits to hear that the station listens."""

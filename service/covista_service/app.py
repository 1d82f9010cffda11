"""The one composition root: builds the station from its settings, opens its parts in order, closes them in reverse."""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, closing, suppress

from covista_schemas.reports import Health, PartHealth
from fastapi import FastAPI

from covista_service import answers
from covista_service.access import Gate, Keyring, TokenError, TokenWatch, check_listening, is_loopback
from covista_service.api import rest
from covista_service.api.deps import Parts, State
from covista_service.api.docs_page import DOCS
from covista_service.api.stream import Stream
from covista_service.config import Settings, with_stored
from covista_service.dashboard.mounting import add_pages
from covista_service.dashboard.opening import opened
from covista_service.dashboard.places import PAGES, has_pages
from covista_service.dashboard.sources import Sources
from covista_service.grouping.warming import warm_up
from covista_service.link.admission import Lock
from covista_service.link.inbox import Inbox
from covista_service.link.mailbox import Mailboxes
from covista_service.link.publish import Publisher
from covista_service.link.queries import Queries
from covista_service.link.station import LinkOptions, StationLink
from covista_service.loop import Loop
from covista_service.loop.vitals import Vitals
from covista_service.station.options import StationOptions
from covista_service.station.station import Station
from covista_service.store.archive import Archive
from covista_service.store.database import check_url
from covista_service.store.history import History
from covista_service.store.retention import Retention
from covista_service.store.tokens import Tokens
from covista_service.telemetry import Telemetry, about
from covista_service.workers import Workers, WorkersOptions, check_kind, daemon

log = logging.getLogger(__name__)

# The loop turns four times a second; when it does not for so long, something blocks it.
_SILENT_S = 2.0


def create_app(settings: Settings) -> FastAPI:
    """The station as an ASGI application; its lifespan opens and closes all.

    Raises AccessError, DatabaseError, TokenError or MissingExtraError.
    """
    check_url(settings.database)
    check_listening(
        settings.api_address.host, settings.link, insecure=settings.insecure, has_tokens=lambda: _has_tokens(settings)
    )
    check_kind(settings.workers)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[State]:
        async with _open_parts(settings) as parts, opened():
            sources = Sources(
                parts.name,
                parts.loop,
                parts.telemetry,
                parts.health,
                parts.vitals,
                parts.gate,
                parts.archive,
                parts.readers,
                listeners=lambda: parts.stream.listeners,
                given_up=lambda: parts.outgoing.given_up + parts.stream.given_up,
            )
            yield {"parts": parts, "dashboard": sources}

    first = f"{PAGES.prefix}/" if has_pages() else DOCS
    app = rest.build(lifespan, settings.cors_origins, PAGES, first)
    add_pages(app)
    return app


def _has_tokens(settings: Settings) -> bool:
    """Whether anybody can be let in. Raises TokenError, for who cannot know that must not listen to everybody."""
    try:
        with closing(Tokens(settings.database)) as tokens:
            return any(token.revoked_us is None for token in tokens.read())
    except TokenError as error:
        raise TokenError(f"{error}; api = {settings.api} is not opened to the network before that is known") from error


@asynccontextmanager
async def _open_parts(settings: Settings) -> AsyncIterator[Parts]:
    async with AsyncExitStack() as stack:

        def close_later(close: Callable[[], object]) -> None:
            # Closing waits for threads; the loop must go on, for they may be asking it something.
            stack.push_async_callback(asyncio.to_thread, close)

        link = await asyncio.to_thread(StationLink, _link_options(settings))
        close_later(link.switchboard.close)
        mailboxes = Mailboxes()
        close_later(link.plug_ingest(mailboxes))
        publisher = Publisher(None, settings.site)
        link.switchboard.plug(publisher.join)
        close_later(publisher.close)
        archive = Archive(settings.database)
        close_later(archive.close)
        retention = Retention(settings.retention_days, settings.retention_mb)
        history = await asyncio.to_thread(lambda: History(settings.database, retention=retention))
        close_later(history.close)
        settings = with_stored(settings, history.stored_settings())
        gate, watch = await asyncio.to_thread(_open_gate, settings, close_later)
        telemetry = Telemetry()
        options = WorkersOptions(settings.workers, settings.workers_count)
        workers = await asyncio.to_thread(Workers, options, telemetry.took)
        close_later(workers.close)
        station = Station(_station_options(settings, workers.capacity))
        memory = await asyncio.to_thread(history.recall, settings.forget_after_s, settings.unknown_after_s)
        station.restore(memory, time.time_ns())
        stream = Stream(memory.event + 1)
        loop = Loop(
            station,
            Inbox(mailboxes),
            workers,
            (publisher, history, stream),
            telemetry,
            next_event=memory.event + 1,
        )
        task = asyncio.create_task(_run(loop), name="covista-loop")
        stack.push_async_callback(_end, task)
        history.follow(loop.ask)
        close_later(link.switchboard.plug(lambda session: Queries(session, settings.site, loop.ask).close))

        def health_now() -> Health:
            moving = {"workers": _crew_health(workers, settings.workers)}
            moving |= {"store": history.health(), "loop": _loop_health(loop, task), "access": watch.health()}
            return _health({"link": link.health(), **moving})

        def vitals_now() -> Vitals:
            return Vitals(
                mail=mailboxes.depths(),
                crew=workers.status(),
                sinks={"zenoh": publisher.status(), "history": history.status()},
                turned_away=mailboxes.turned_away,
                sessions=link.switchboard.sessions,
                link_refused=link.refused,
            )

        log.info("starts", extra=about(**settings.shown))
        yield Parts(
            loop,
            telemetry,
            health_now,
            vitals_now,
            secrets.token_hex(4),
            gate,
            archive=archive,
            flush=history.flush,
            stream=stream,
            renew=link.switchboard.renew,
        )
        log.info("stops", extra=about(surveys=telemetry.summary().surveys))


def _link_options(settings: Settings) -> LinkOptions:
    tls = settings.zenoh_tls
    robots = settings.zenoh_tls_robots if settings.link else None
    lock = None if tls is None else Lock(tls, robots, settings.zenoh_tls_peers)
    return LinkOptions(settings.link, settings.connect, settings.site, lock)


def _open_gate(settings: Settings, close_later: Callable[[Callable[[], object]], None]) -> tuple[Gate, TokenWatch]:
    """Who may ask, by tokens that are read for as long as the station runs."""
    tokens = Tokens(settings.database)
    close_later(tokens.close)
    keyring = Keyring(locked=not (settings.insecure or is_loopback(settings.api_address.host)))
    watch = TokenWatch(tokens, keyring)
    close_later(watch.close)
    return Gate(keyring, news=watch.news, any_host=settings.insecure), watch


async def _run(loop: Loop) -> None:
    """Run the loop once it can group: where code has to be compiled first, everybody else must not wait for it."""
    try:
        await asyncio.wrap_future(daemon.start(warm_up, "covista-loading-groups"))
    except Exception:
        log.warning("compiled code could not be loaded ahead; the first groups will wait for it", exc_info=True)
    await loop.run()


async def _end(task: asyncio.Task[None]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def _crew_health(workers: Workers, kind: str) -> PartHealth:
    crew = workers.status()
    detail = f"{crew.capacity} jobs at {kind}" if crew.kind == "dask" else f"{crew.capacity} {kind}"
    if not workers.warm:
        return PartHealth(status="starting", detail=f"{detail}, loading compiled code")
    if crew.fallback is not None:
        return PartHealth(status="degraded", detail=crew.fallback)
    return PartHealth(status="ready", detail=detail if crew.remark is None else f"{detail}; {crew.remark}")


def _loop_health(loop: Loop, task: asyncio.Task[None]) -> PartHealth:
    if task.done():
        return PartHealth(status="stopping", detail="the loop has ended")
    if not loop.running:
        return PartHealth(status="starting", detail="loading compiled code")
    silent_s = loop.silent_s()
    if silent_s > _SILENT_S:
        return PartHealth(status="degraded", detail=f"no turn for {silent_s:.1f} s")
    return PartHealth(status="ready")


def _health(parts: dict[str, PartHealth]) -> Health:
    """As well as its worst part."""
    for status in ("stopping", "starting", "degraded"):
        if any(part.status == status for part in parts.values()):
            return Health.model_validate({"status": status, "parts": parts})
    return Health(status="ready", parts=parts)


def _station_options(settings: Settings, capacity: int) -> StationOptions:
    return StationOptions(
        capacity=capacity,
        live_after_s=settings.live_after_s,
        gone_after_s=settings.gone_after_s,
        forget_after_s=settings.forget_after_s,
        decay_after_s=settings.decay_after_s,
        unknown_after_s=settings.unknown_after_s,
        retry_after_s=settings.retry_after_s,
        grouping=answers.grouping_options(settings.live),
    )

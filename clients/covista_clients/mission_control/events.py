"""Events live, by server-sent events, over as many connections as it takes."""

from __future__ import annotations

import json
import logging
import random
import socket
import threading
import time
from collections.abc import Generator, Iterator
from types import TracebackType
from typing import Self

import httpx
from covista_schemas.errors import ApiError
from covista_schemas.reports import EventKind, EventReport
from httpx_sse import EventSource, ServerSentEvent, SSEError
from pydantic import ValidationError

from covista_clients.mission_control.connection import ATTEMPTS, TRANSIENT, Connection

logger = logging.getLogger(__name__)

# The station lets hear of itself every 15 s; who is silent for three times that is gone.
QUIET_S = 45.0
_FIRST_PAUSE_S = 0.5
MOST_PAUSE_S = 15.0
_MOST_RETRY_AFTER_S = 60.0
_KINDS = frozenset(EventKind)


class Events(Iterator[EventReport]):
    """Events as they happen, without an end of their own; use it as a context manager, or close it.

    A connection that breaks is replaced by another one that begins after the last event. What the station no longer
    has of what came in between is named by a warning in the log. A station that cannot be reached at first, or that
    refuses, is an ApiError. `close` may be called from any thread.
    """

    def __init__(self, connection: Connection, last_event_id: int | str | None = None) -> None:
        """With `last_event_id`, all events after that one; without, those that happen from now on."""
        self.last_event_id = None if last_event_id is None else str(last_event_id)
        self._connection = connection
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._response: httpx.Response | None = None
        self._connected = False
        self._base_pause_s = _FIRST_PAUSE_S
        self._told = self._tell()

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> EventReport:
        return next(self._told)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Tell no more; whoever waits for an event comes to the end of the iterator."""
        self._closed.set()
        with self._lock:
            if self._response is not None:
                _hang_up(self._response)

    def _tell(self) -> Generator[EventReport]:
        failures = 0
        while not self._closed.is_set():
            began_s, before = time.monotonic(), self.last_event_id
            problem: Exception | None = None
            try:
                yield from self._listen()
            except (httpx.HTTPError, ApiError) as error:
                if self._closed.is_set():
                    return
                self._judge(error, failures)
                problem = error
            except RuntimeError:
                # The client was closed under it.
                if self._closed.is_set():
                    return
                raise
            moved = self.last_event_id != before or time.monotonic() - began_s > MOST_PAUSE_S
            failures = 0 if moved else failures + 1
            self._rest(failures, problem)

    def _listen(self) -> Generator[EventReport]:
        """The events of one connection."""
        headers = {"Accept": "text/event-stream", "Cache-Control": "no-store"}
        if self.last_event_id is not None:
            headers["Last-Event-ID"] = self.last_event_id
        response = self._connection.open_stream("/api/v1/events", headers, QUIET_S)
        try:
            with self._lock:
                self._response = response
            if self._closed.is_set():
                return
            self._connected = True
            for sse in EventSource(response).iter_sse():
                report = self._take(sse)
                if report is not None:
                    yield report
        except SSEError as error:
            raise _not_a_station(response, str(error)) from error
        finally:
            with self._lock:
                self._response = None
            response.close()

    def _take(self, sse: ServerSentEvent) -> EventReport | None:
        """The event, None for what is about the stream itself or of a kind that only later versions know."""
        if sse.retry is not None:
            self._base_pause_s = min(max(sse.retry / 1000, 0.0), MOST_PAUSE_S)
        if sse.event == "reset":
            logger.warning("events are missing: %s", _words(sse.data))
        elif sse.event == "cut":
            logger.info("the station ends the stream of events: %s", _words(sse.data))
            return None
        if sse.id:
            self.last_event_id = sse.id
        if sse.event not in _KINDS:
            return None
        try:
            return EventReport.read(sse.data)
        except ValidationError as error:
            raise ApiError(
                "the stream of events does not tell events as a station does", detail=_words(sse.data)
            ) from error

    def _judge(self, error: Exception, failures: int) -> None:
        """Raise what trying again does not mend."""
        if isinstance(error, ApiError):
            passing = error.status in TRANSIENT or error.status == 429
            if passing and (self._connected or failures + 1 < ATTEMPTS):
                return
            raise error
        if not self._connected and (failures + 1 >= ATTEMPTS or isinstance(error, httpx.UnsupportedProtocol)):
            raise self._connection.no_answer(error) from error

    def _rest(self, failures: int, problem: Exception | None) -> None:
        """Wait before the next connection; a stream that was ended in order is no trouble."""
        if self._closed.is_set():
            return
        pause_s = min(MOST_PAUSE_S, self._base_pause_s * 2 ** min(failures, 10)) * random.uniform(0.5, 1.0)
        if isinstance(problem, ApiError) and problem.retry_after_s is not None:
            pause_s = max(pause_s, min(problem.retry_after_s, _MOST_RETRY_AFTER_S))
        level = logging.WARNING if problem is not None and failures <= 1 else logging.DEBUG
        reason = "the stream ended" if problem is None else str(problem) or type(problem).__name__
        logger.log(level, "events: %s; connecting again in %.1f s", reason, pause_s)
        self._closed.wait(pause_s)


def _hang_up(response: httpx.Response) -> None:
    """End the reading of another thread: closing a socket does not wake whoever reads from it."""
    stream = response.extensions.get("network_stream")
    connected = stream.get_extra_info("socket") if stream is not None else None
    if connected is not None:
        try:
            # Not the method of a TLS socket, which takes its state away under the reader.
            socket.socket.shutdown(connected, socket.SHUT_RDWR)
        except OSError:
            logger.debug("the stream of events had ended by itself")


def _not_a_station(response: httpx.Response, detail: str) -> ApiError:
    return ApiError(f"{response.url} does not answer as a station does", detail=detail)


def _words(data: str) -> str:
    """What `cut` and `reset` say, for people."""
    try:
        said = json.loads(data)
    except ValueError:
        said = None
    match said:
        case {"title": str(title), "detail": str(detail)}:
            return f"{title}: {detail}"
        case {"title": str(title)}:
            return title
        case {"first": int(first), "last": int(last), "reason": str(reason)}:
            return f"{first} to {last}: {reason}"
        case _:
            return data[:300]

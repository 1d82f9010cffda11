"""Events for those who listen to them over HTTP: a sink of the loop that hands each one on.

An event is put into words once, however many listen. Nobody is waited for: what a listener has not been sent yet waits
with him, up to a bound, and one that falls behind is cut off. The newest events are kept here for who comes back, since
those may not be in the history yet. For the thread of the event loop alone.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from covista_schemas.errors import CovistaError
from covista_schemas.reports import EventsMissed, Problem, Report

from covista_service.loop import News

# A listener may be so many events behind, and so many may listen.
BUFFER = 256
LISTENERS = 256
# Events kept for who comes back: more than a history that works has not written yet.
KEPT = 1024
# Nobody listens longer without asking anew, so that whoever may not any more is heard of.
LONGEST_S = 3600.0
BEHIND, CROWD = "behind", "crowd"
EVENT_STREAM = "text/event-stream"
# The last word of a stream that the station ends.
CUT_EVENT = "cut"


# Who is cut off may take so long to hear the last word; where the station stops, so long.
_FAREWELL_S = 5.0
_STOP_S = 0.4
_RESUME = "ask again with the id of the last event that came as Last-Event-ID"
_BEHIND = Problem(
    title="Reads too slowly",
    status=503,
    detail=f"more events waited than the station keeps for one listener; {_RESUME}",
)
_STOPS = Problem(title="The station is stopping", status=503, detail=_RESUME)
LONG_ENOUGH = Problem(title="Listened for long enough", status=503, detail=_RESUME)


class CrowdedError(CovistaError):
    """As many listen as may, or nobody may any more; the text says which."""


@dataclass(frozen=True, slots=True)
class Told:
    """An event as it goes out."""

    number: int
    text: bytes


class Listener:
    """One who listens: what is still to be sent to him. `cut` ends his connection, whether he reads or not."""

    def __init__(self, buffer: int, cut: Callable[[], None]) -> None:
        self._buffer = buffer
        self._cut = cut
        self._waiting: deque[Told] = deque()
        self._awake = asyncio.Event()
        self._farewell = b""
        self._last_call: asyncio.TimerHandle | None = None
        self.ended = False

    def put(self, events: Sequence[Told]) -> bool:
        """Have these sent; False if he is behind already, and would be by more than he may."""
        if self._waiting and len(self._waiting) + len(events) > self._buffer:
            return False
        self._waiting.extend(events)
        self._awake.set()
        return True

    def end(self, farewell: Problem | None = None, within_s: float = _FAREWELL_S) -> None:
        """Cut him off: what waits is not sent any more, and he is told why, if he reads it within so long."""
        if self.ended:
            return
        self.ended = True
        self._farewell = b"" if farewell is None else encode(CUT_EVENT, farewell)
        self._waiting.clear()
        self._awake.set()
        self._last_call = asyncio.get_running_loop().call_later(within_s, self._cut)

    async def next(self, patience_s: float) -> bytes:
        """What is to be sent next, all that waits at once; empty when nothing has come in so long."""
        if not self._waiting and not self.ended:
            try:
                async with asyncio.timeout(patience_s):
                    await self._awake.wait()
            except TimeoutError:
                return b""
        self._awake.clear()
        text = b"".join(told.text for told in self._waiting)
        self._waiting.clear()
        return text + self._farewell

    def close(self) -> None:
        """All is said."""
        if self._last_call is not None:
            self._last_call.cancel()


class Stream:
    """All who listen, and the newest events.

    `next_event` is the number of the first event to come: what is older may be in the history.
    """

    def __init__(
        self,
        next_event: int = 1,
        *,
        buffer: int = BUFFER,
        listeners: int = LISTENERS,
        kept: int = KEPT,
        longest_s: float | None = None,
    ) -> None:
        self._recent: deque[Told] = deque(maxlen=kept)
        self._next = next_event
        self._since = next_event
        self._first = next_event
        self._buffer = buffer
        self._most = listeners
        self._inside: dict[Listener, None] = {}
        self._hearing: dict[Listener, None] = {}
        self._closed = False
        self.longest_s = LONGEST_S if longest_s is None else longest_s
        # Who was cut off or not let in, by reason.
        self.given_up: Counter[str] = Counter()

    @property
    def listeners(self) -> int:
        """How many listen."""
        return len(self._inside)

    @property
    def first(self) -> int:
        """The number of the first event since the station started, told or not."""
        return self._first

    @property
    def since(self) -> int:
        """All events from this number on are kept here."""
        return self._since

    @property
    def last(self) -> int:
        """The number of the last event; one less than the first to come where there is none."""
        return self._next - 1

    def take(self, news: News) -> None:
        """Hand on what has happened."""
        if not news.events:
            return
        told = [Told(event.id, encode(event.event, event, event.id)) for event in news.events]
        self._recent.extend(told)
        self._next = told[-1].number + 1
        if len(self._recent) == self._recent.maxlen:
            self._since = self._recent[0].number
        for listener in [each for each in self._hearing if not each.put(told)]:
            self.given_up[BEHIND] += 1
            del self._hearing[listener]
            listener.end(_BEHIND)

    def enter(self, cut: Callable[[], None]) -> Listener:
        """Let somebody in, who hears nothing yet. Raises CrowdedError."""
        if self._closed:
            raise CrowdedError("The station is stopping")
        if len(self._inside) >= self._most:
            self.given_up[CROWD] += 1
            raise CrowdedError("Too many listen already")
        listener = Listener(self._buffer, cut)
        self._inside[listener] = None
        return listener

    def hear(self, listener: Listener, after: int | None) -> bytes:
        """Have him hear all from now on; what he is to be sent first is the events after this number.

        They must be kept here; None is for no more than those to come.
        """
        self._hearing[listener] = None
        return b"".join(told.text for told in self._recent if after is not None and told.number > after)

    def leave(self, listener: Listener) -> None:
        """Nobody listens there any more."""
        self._inside.pop(listener, None)
        self._hearing.pop(listener, None)
        listener.close()

    def close(self) -> None:
        """Have all streams end at once, each with a last word."""
        self._closed = True
        self._hearing.clear()
        for listener in self._inside:
            listener.end(_STOPS, _STOP_S)


def encode(event: str, report: Report, number: int | None = None) -> bytes:
    """An event of a stream: its JSON is one line, for JSON has no line breaks in strings."""
    name = "" if number is None else f"id: {number}\n"
    return (
        f"{name}event: {event}\ndata: {report.model_dump_json(exclude_none=isinstance(report, Problem))}\n\n".encode()
    )


def missed(first: int, last: int, reason: str) -> bytes:
    """Events that a stream cannot give again; who comes back after that asks for what follows them."""
    return encode("reset", EventsMissed(first=first, last=last, reason=reason), last)

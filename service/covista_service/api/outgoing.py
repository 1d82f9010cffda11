"""What is on its way to clients, bounded whether they read or not.

Large answers are shared: those who ask for the same while it is being made get the same bytes, made once. Where too
many bytes are still on their way to clients that read slowly, others get the newest answer there is, or none.
"""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

# Answers of a thousand robots' matrices have some 60 MB.
MAX_BYTES = 256 * 1024 * 1024
# Given to the connection at a time; more of it waits here, shared, and not in each connection's buffer.
CHUNK_BYTES = 128 * 1024
Piece = bytes | memoryview
# Answers kept for who asks next.
_KINDS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The content of an answer in pieces, and what version of it that is."""

    chunks: tuple[bytes, ...]
    tag: str = ""
    size: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", sum(map(len, self.chunks)))


def body_of(pieces: Iterable[Piece], tag: str = "") -> Body:
    """A body of these pieces, put together and cut so that each is some `CHUNK_BYTES` long."""
    chunks: list[bytes] = []
    waiting: list[Piece] = []
    size = 0
    for piece in pieces:
        for at in range(0, len(piece), CHUNK_BYTES):
            part = piece[at : at + CHUNK_BYTES]
            waiting.append(part)
            size += len(part)
            if size >= CHUNK_BYTES:
                chunks.append(b"".join(waiting))
                waiting, size = [], 0
    return Body((*chunks, b"".join(waiting)) if waiting else tuple(chunks), tag)


class Outgoing:
    """The large answers that are being sent; for the thread of the event loop alone."""

    def __init__(self, most_bytes: int = MAX_BYTES) -> None:
        self._most_bytes = most_bytes
        self._held: Counter[Body] = Counter()
        self._making = asyncio.Lock()
        self._sending = asyncio.Lock()
        self._begun = 0
        # The newest of each kind, and as which answer it was begun.
        self._newest: OrderedDict[str, tuple[int, Body]] = OrderedDict()
        # Answers refused and connections cut, by reason.
        self.given_up: Counter[str] = Counter()

    @property
    def held_bytes(self) -> int:
        """Bytes of all answers that are being sent, each counted once."""
        return sum(body.size for body in tuple(self._held))

    def take(self, body: Body) -> bool:
        """Begin to send; False if too much is on its way already, which a body that others are sent too never is."""
        if body not in self._held and self._held and self.held_bytes + body.size > self._most_bytes:
            return False
        self._held[body] += 1
        return True

    def give_back(self, body: Body) -> None:
        """End to send what was taken."""
        self._held[body] -= 1
        if not self._held[body]:
            del self._held[body]

    async def chunk_turn(self) -> None:
        """Wait for the turn to send one more chunk.

        To clients that read fast, sending never waits: hundreds of them would get a chunk each before anybody else
        hears of the event loop. So one chunk goes out each time round.
        """
        async with self._sending:
            await asyncio.sleep(0)

    async def share(self, kind: str, tag: Callable[[], str], make: Callable[[], Callable[[], Iterable[Piece]]]) -> Body:
        """The answer of a kind with the `tag` of now, made in another thread unless it is there, one at a time.

        `make` is called here and gives what makes it there. Who waits while another is made gets the next, or that one
        if it was begun after he came; where too much is on its way, the newest there is. An empty tag is like no other.
        """
        came = self._begun
        async with self._making:
            number, newest = self._newest.get(kind, (0, None))
            wanted = tag()
            if newest is not None and (number > came or newest.tag == wanted != "" or self._crowded(newest)):
                return newest
            self._begun = begun = self._begun + 1
            pieces = make()
            body = await asyncio.to_thread(lambda: body_of(pieces(), wanted))
            self._newest[kind] = begun, body
            self._newest.move_to_end(kind)
            while len(self._newest) > _KINDS:
                self._newest.popitem(last=False)
            return body

    def _crowded(self, newest: Body) -> bool:
        return self.held_bytes + (0 if newest in self._held else newest.size) + newest.size > self._most_bytes

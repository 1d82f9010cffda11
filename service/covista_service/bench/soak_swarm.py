"""The rovers of the soak, which join, leave, are killed, pause, and start again, as its script has it.

The script is the same for the same seed. What is not possible at its turn is let be: a pause of who is paused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from covista_service.bench.soak_books import Books
from covista_service.bench.soak_rover import Told
from covista_service.bench.soak_script import Turn

# A rover that was paused goes on for so long before anything else happens to it: its link may have to be made anew.
AFTER_PAUSE_S = 10.0
# For leaving in order, and then for the station to have heard all that was sent.
LEAVE_S, AGREE_S = 15.0, 10.0


class Body(Protocol):
    """A rover's process, or what stands for it. `told` is what it has said so far that it has sent, and when."""

    @property
    def told(self) -> Sequence[tuple[float, Told]]:
        """All of it, once it has been closed."""

    def leave(self) -> None:
        """Tell it to end in order."""

    def kill(self) -> None:
        """End it at once."""

    def pause(self) -> None:
        """Stop it where it is."""

    def go_on(self) -> None:
        """Let it go on."""

    def ended(self) -> bool:
        """Has it?"""

    def close(self) -> None:
        """Wait for its end, and read what it has said."""


@dataclass(slots=True, eq=False)
class Boot:
    """A rover, and what is happening to it. Once it has left, its books are still to be compared."""

    body: Body
    paused_until_s: float | None = None
    untouched_until_s: float = 0.0
    leaves_until_s: float | None = None
    compares_until_s: float | None = None

    def free(self, now_s: float) -> bool:
        """May something happen to it?"""
        busy = (self.paused_until_s, self.leaves_until_s, self.compares_until_s)
        return busy == (None, None, None) and now_s >= self.untouched_until_s


class SoakSwarm:
    """Rovers and what happens to them. `happen` is to be called often, and returns at once.

    `start` begins a boot of a robot, `garble` sends garbage in its name and says how much.
    """

    def __init__(
        self,
        start: Callable[[int], Body],
        garble: Callable[[int], int],
        script: Iterator[Turn],
        books: Books,
        clock: Callable[[], float],
    ) -> None:
        self.happened: Counter[str] = Counter()
        self.died = 0
        self._start, self._garble, self._script = start, garble, script
        self._books, self._clock = books, clock
        self._boots: dict[int, Boot] = {}
        self._next = next(script)
        self._next_s = clock() + self._next.gap_s

    @property
    def there(self) -> frozenset[int]:
        """Who has a process, or has just left."""
        return frozenset(self._boots)

    def gather(self, robots: Sequence[int]) -> None:
        """Let these join."""
        for robot in robots:
            self._join(robot)

    def happen(self) -> None:
        """Let happen what is due."""
        now_s = self._clock()
        self._look_after(now_s)
        while now_s >= self._next_s:
            self._befall(self._next, now_s)
            self._next = next(self._script)
            self._next_s += self._next.gap_s

    def disperse(self) -> None:
        """Let all leave in order, once they may; they have when nobody is `there`."""
        now_s = self._clock()
        for boot in self._boots.values():
            if boot.paused_until_s is not None:
                self._go_on(boot, now_s)
        self._look_after(now_s)
        for boot in self._boots.values():
            if boot.free(now_s):
                self._leave(boot, now_s)

    def end(self) -> None:
        """Leave no process behind, however the soak ends."""
        for boot in self._boots.values():
            boot.body.kill()
            boot.body.close()
        self._boots.clear()

    def _look_after(self, now_s: float) -> None:
        for robot, boot in list(self._boots.items()):
            if boot.compares_until_s is not None:
                self._compare(robot, boot.compares_until_s, now_s)
            elif boot.body.ended():
                self.died += boot.leaves_until_s is None
                self._over(robot, now_s)
                boot.compares_until_s = now_s + AGREE_S
            elif boot.leaves_until_s is not None and boot.leaves_until_s <= now_s:
                boot.body.kill()
            elif boot.paused_until_s is not None and boot.paused_until_s <= now_s:
                self._go_on(boot, now_s)

    def _befall(self, turn: Turn, now_s: float) -> None:
        boot = self._boots.get(turn.robot)
        if boot is None:
            self._join(turn.robot)
            self.happened["join"] += 1
        elif boot.free(now_s):
            self._act(turn, boot, now_s)
            self.happened[turn.act] += 1

    def _act(self, turn: Turn, boot: Boot, now_s: float) -> None:
        match turn.act:
            case "leave":
                self._leave(boot, now_s)
            case "pause":
                boot.body.pause()
                boot.paused_until_s = now_s + turn.pause_s
            case "garbage":
                self._books.garbage(turn.robot, self._garble(turn.robot))
            case "kill" | "reboot":
                boot.body.kill()
                self._over(turn.robot, now_s)
                del self._boots[turn.robot]
                if turn.act == "reboot":
                    self._join(turn.robot)

    def _join(self, robot: int) -> None:
        self._books.join(robot, self._clock())
        self._boots[robot] = Boot(self._start(robot))

    def _leave(self, boot: Boot, now_s: float) -> None:
        boot.body.leave()
        boot.leaves_until_s = now_s + LEAVE_S

    def _go_on(self, boot: Boot, now_s: float) -> None:
        boot.body.go_on()
        boot.paused_until_s, boot.untouched_until_s = None, now_s + AFTER_PAUSE_S

    def _over(self, robot: int, now_s: float) -> None:
        """Enter what a boot has sent into the books."""
        body = self._boots[robot].body
        body.close()
        self._books.over(robot, body.told, now_s)

    def _compare(self, robot: int, until_s: float, now_s: float) -> None:
        """Now if the books agree, else when there is no more hope that they will."""
        if self._books.agrees(robot) or now_s >= until_s:
            self._books.compare(robot)
            del self._boots[robot]

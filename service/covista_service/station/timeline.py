"""The station's own time, which never falls: wall time until that is set back, from then on ahead of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from covista_service.station.events import (
    Effect,
    Event,
    GroupsEvaluated,
    Happened,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
)


class Timeline:
    """Turns wall time into the station's time and back; it is `ahead_ns` of the wall.

    Ages, presence and all that comes due are reckoned in it, so that none is negative or waits for a clock that was set
    back until it is where it was. What others are told of is in wall time.
    """

    def __init__(self) -> None:
        self.ahead_ns = 0
        self._now_ns: int | None = None

    def at(self, wall_ns: int) -> int:
        """The station's time now; as it was, if the wall's has fallen since it was asked for last."""
        now_ns = wall_ns + self.ahead_ns
        if self._now_ns is not None and now_ns < self._now_ns:
            self.ahead_ns += self._now_ns - now_ns
            now_ns = self._now_ns
        self._now_ns = now_ns
        return now_ns

    def peek(self, wall_ns: int) -> int:
        """The station's time as it would be now; nothing is the later for it."""
        now_ns = wall_ns + self.ahead_ns
        return now_ns if self._now_ns is None else max(now_ns, self._now_ns)

    def wall_ns(self, now_ns: int) -> int:
        """What the clock on the wall shows at a moment of the station's time, as it goes now."""
        return now_ns - self.ahead_ns

    def heard(self, event: Event) -> Event:
        """An event with its arrival in the station's time: what came before the wall's was set back came just now."""
        if not self.ahead_ns:
            return event
        match event:
            case MessagesReceived() | MessageDropped() | PoseArrived():
                return replace(event, arrived_ns=self._arrived(event.arrived_ns))
            case KeyframeArrived(keyframe):
                return KeyframeArrived(replace(keyframe, arrived_ns=self._arrived(keyframe.arrived_ns)))
        return event

    def told(self, effects: Iterable[Effect]) -> list[Effect]:
        """Effects with their moments in wall time."""
        return [self._told(effect) for effect in effects] if self.ahead_ns else list(effects)

    def _arrived(self, wall_ns: int) -> int:
        arrived_ns = wall_ns + self.ahead_ns
        return arrived_ns if self._now_ns is None else min(arrived_ns, self._now_ns)

    def _told(self, effect: Effect) -> Effect:
        match effect:
            case Happened():
                return replace(effect, time_ns=self.wall_ns(effect.time_ns))
            case GroupsEvaluated(keyframes):
                return GroupsEvaluated(tuple((name, self.wall_ns(arrived_ns)) for name, arrived_ns in keyframes))
        return effect

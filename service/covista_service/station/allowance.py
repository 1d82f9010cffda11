"""How much may be done by now, at a steady rate: what was not used is kept for a moment."""

from __future__ import annotations

from covista_service.station.options import NS_PER_S

_KEPT_S = 0.25


class Allowance:
    """A bucket that fills at `per_s` and holds what comes in a quarter of a second; full at first."""

    def __init__(self, per_s: float) -> None:
        self._per_ns = per_s / NS_PER_S
        self._most = per_s * _KEPT_S
        self._left = self._most
        self._filled_ns: int | None = None

    def at(self, now_ns: int) -> int:
        """How much there is at `now_ns`, 0 or less if all is spent. A clock that was set back adds nothing."""
        if self._filled_ns is not None:
            self._left = min(self._left + max(now_ns - self._filled_ns, 0) * self._per_ns, self._most)
        self._filled_ns = now_ns
        return int(self._left)

    def spend(self, amount: int) -> None:
        """Take so much; it may be more than there is, and is missed later."""
        self._left -= amount

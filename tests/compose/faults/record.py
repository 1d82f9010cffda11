"""How soon faults are noticed and recovered from, kept over a session and shown as a table at its end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from statistics import median


@dataclass(frozen=True, slots=True)
class Row:
    """One fault, once: seconds to notice and to recover where there is such a thing, and what was lost."""

    fault: str
    seen: str
    noticed_s: Mapping[str, float] = field(default_factory=dict)
    recovered_s: float | None = None
    lost: str = "nothing"
    # In how many seconds it is meant to have recovered.
    most_s: float | None = None


class Record:
    """Rows in the order in which they came."""

    def __init__(self) -> None:
        self._rows: dict[str, list[Row]] = {}

    def add(self, row: Row) -> None:
        """Keep one more run of a fault."""
        self._rows.setdefault(row.fault, []).append(row)

    def lines(self) -> Iterator[str]:
        """The table: medians, and the worst in brackets where there were several runs."""
        if self._rows:
            yield "fault | runs | seen | noticed after | recovered after | lost"
        for fault, rows in self._rows.items():
            names = dict.fromkeys(name for row in rows for name in row.noticed_s)
            noticed = ", ".join(
                f"{name} {_spread([row.noticed_s[name] for row in rows if name in row.noticed_s])}" for name in names
            )
            recovered = [row.recovered_s for row in rows if row.recovered_s is not None]
            lost = "; ".join(dict.fromkeys(row.lost for row in rows))
            seen = rows[-1].seen
            back = _spread(recovered) + _judged(recovered, rows[-1].most_s)
            yield f"{fault} | {len(rows)} | {seen} | {noticed or '-'} | {back} | {lost}"


def _spread(values: list[float]) -> str:
    if not values:
        return "-"
    worst = f" ({max(values):.1f})" if len(values) > 1 else ""
    return f"{median(values):.1f}{worst} s"


def _judged(values: list[float], most_s: float | None) -> str:
    if most_s is None:
        return ""
    holds = "holds" if max(values) <= most_s else f"{sum(each <= most_s for each in values)} of {len(values)} hold"
    return f" (mark {most_s:g} s: {holds})"

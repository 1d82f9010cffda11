"""What an experiment comes to: figures of ours beside the printed ones, and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass

Value = float | int | str | None
Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Item:
    """One line of paper.json.

    `item` is the table or figure of the paper, or a name of ours. Where nothing is printed, `case` states the law that
    is checked.
    """

    item: str
    case: str
    printed: Value
    ours: Value
    agrees: bool

    def as_json(self) -> dict[str, Value]:
        """The line as it stands in paper.json."""
        return asdict(self)


@dataclass(frozen=True, slots=True, eq=False)
class Chapter:
    """Items of an experiment, and its pictures as PNG bytes by file name."""

    items: tuple[Item, ...]
    pictures: Mapping[str, bytes]


Experiment = Callable[[Tell], Chapter]

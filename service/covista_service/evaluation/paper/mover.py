"""Fig. 8: a camera that leaves one group, is alone for a while, and joins another; as many groups as Eq. 17 says."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from covista_service.drawing.scenario import from_above
from covista_service.evaluation.paper import grouped
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.paper.grouped import ADAPTIVE, STATION, Groups
from covista_service.evaluation.paper.layouts import (
    BLUE,
    GREEN,
    MOVER_X_M,
    MOVER_Y_M,
    RED,
    Scenario,
    plain,
    seen,
)
from covista_service.evaluation.paper.stages import stage

NAME = "Fig. 8"
ALPHA = 0.5
LEAST_LEAD = 0.1
# Number of groups, and with whom the mover is.
PRINTED: tuple[tuple[int, str], ...] = ((3, "red"), (3, "red"), (3, "red"), (4, "alone"), (3, "blue"), (3, "blue"))
_LETTERS = "abcdef"
_MOVER = 1
# Cameras as they are numbered, from 1, and in the order of their colours.
_TEAMS = {"blue": (4, 5, 6), "red": (2, 3), "green": (7, 8, 9)}
_NAMES = ("m", "r1", "r2", "b1", "b2", "b3", "g1", "g2", "g3")


def mover(tell: Tell) -> Chapter:
    """The chapter."""
    tell(f"{NAME}: six snapshots")
    snapshots = [snapshot(k) for k in range(len(MOVER_X_M))]
    found = {
        way: [grouped.groups(seen(each), ALPHA, way) for each in snapshots]
        for way in dict.fromkeys((ADAPTIVE, STATION))
    }
    apart = [grouped.groups(seen(each), 1.0, ADAPTIVE) for each in snapshots[2:5]]
    lead = min(grouped.lead(seen(each), ALPHA, ADAPTIVE) for each in snapshots)
    items = [*_printed(found[ADAPTIVE]), _ahead(lead), _overlap_only(apart), *_station(found[STATION])]
    title = f"{NAME}: splitting and merging of a moving camera, alpha = {ALPHA:g}"
    drawn = {
        "fig_8.png": _picture(snapshots, found[ADAPTIVE], title),
        "fig_8_default.png": _picture(snapshots, found[STATION], f"{title}, by the station's default"),
    }
    return Chapter(tuple(items), drawn)


@cache
def snapshot(k: int) -> Scenario:
    """The cameras when the mover has come to the k-th place: the mover, then red, blue and green."""
    return plain(f"({_LETTERS[k]})", [(MOVER_X_M[k], MOVER_Y_M), *RED, *BLUE, *GREEN])


def company(groups: Groups) -> str:
    """With whom the mover is: a colour, nobody, or the numbers of the cameras if they are not one of the teams."""
    others = tuple(camera for group in groups if _MOVER in group for camera in group if camera != _MOVER)
    if not others:
        return "alone"
    return next((name for name, team in _TEAMS.items() if team == others), grouped.text((others,)))


def _printed(found: Sequence[Groups]) -> list[Item]:
    items = []
    for letter, groups, (count, friends) in zip(_LETTERS, found, PRINTED, strict=True):
        items += [
            Item(NAME, f"({letter}): number of groups", count, len(groups), len(groups) == count),
            Item(NAME, f"({letter}): the mover is with", friends, company(groups), company(groups) == friends),
        ]
    return items


def _ahead(lead: float) -> Item:
    law = f"in every snapshot the number of groups is at least {LEAST_LEAD:.0%} ahead of the next in Eq. 17"
    return Item(NAME, law, None, round(lead, 3), lead >= LEAST_LEAD)


def _overlap_only(apart: Sequence[Groups]) -> Item:
    ours = grouped.text(apart[0]) if len(set(apart)) == 1 else "not the same"
    return Item(NAME, "alpha = 1: the groups of (c), (d) and (e)", "the same", ours, len(set(apart)) == 1)


def _station(found: Sequence[Groups]) -> list[Item]:
    """What a station that nobody has told otherwise makes of it; a team is whole when it is in one group."""
    friends = [company(groups) for groups in found]
    whole = all(any(set(team) <= set(group) for group in groups) for team in _TEAMS.values() for groups in found)
    gone = [name for k, name in enumerate(friends) if k == 0 or name != friends[k - 1]]
    return [
        Item(
            f"{NAME}, the station's default",
            "the mover starts with red and ends with blue, and has no other company",
            None,
            ", ".join(friends),
            gone in (["red", "blue"], ["red", "alone", "blue"]),
        ),
        Item(
            f"{NAME}, the station's default",
            "red, blue and green are never split; number of groups from (a) to (f)",
            None,
            ", ".join(str(len(groups)) for groups in found),
            whole,
        ),
    ]


def _picture(snapshots: Sequence[Scenario], found: Sequence[Groups], title: str) -> bytes:
    """The groups' colours follow them from snapshot to snapshot."""
    stages, colours = [], dict[str, int]()
    for each, x, labelled in zip(snapshots, MOVER_X_M, grouped.followed(found), strict=True):
        for label, cameras in labelled.items():
            colours.setdefault(label, _colour(cameras))
        colour = {camera: colours[label] for label, cameras in labelled.items() for camera in cameras}
        caption = f"{each.name} mover at x = {x:g} m: {len(labelled)} groups"
        stages.append(stage(each, caption, colour, names=_NAMES))
    return from_above(stages, title, ("blue: b1, b2, b3", "red: r1, r2", "green: g1, g2, g3", "m, the mover, alone"))


def _colour(cameras: Sequence[int]) -> int:
    """The number of a new group's colour: that of the team in it, or the one that is left."""
    return next((k for k, team in enumerate(_TEAMS.values()) if set(team) <= set(cameras)), len(_TEAMS))

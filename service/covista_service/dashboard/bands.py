"""Groups over time: of each robot in which group it stood when, in the order that keeps together who were together."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from covista_schemas.reports import Gap, GroupsReport
from scipy.cluster.hierarchy import leaves_list, linkage
from scipy.spatial.distance import squareform

from covista_service.answers.past import Archive
from covista_service.dashboard.past_frames import standing
from covista_service.perception.camera import Floats

# A page of the history, and how many robots times revisions are read for one answer; beyond, it is thinned.
_PAGE = 200
_CELLS = 60_000
# Of a long time so many moments are looked at: more than that can hardly be told apart on a screen.
_MOMENTS = 300
_MOST_GAPS = 100
# Of so many robots at most the order is the best that there is; beyond the other, it is that of the last groups.
_FEW, _MANY = 120, 300
# Who were together for so much of their time stand in the order of names.
_ALIKE = 0.98
_MS = 1_000_000
# In the place of a label, for a robot that was not known then.
ABSENT = ""


@dataclass(frozen=True, slots=True)
class Revisions:
    """Revisions of the groups in the order of time, the first of them in force as the time begins.

    Where they are `thinned` some between them are left out.
    """

    reports: tuple[GroupsReport, ...]
    gaps: tuple[Gap, ...]
    thinned: bool


def bands(archive: Archive, since_ns: int, until_ns: int) -> dict[str, Any]:
    """What the page draws: of each robot [ms since the epoch, label, None or ABSENT] from when on it stood there."""
    found = revisions(archive, since_ns, until_ns)
    begins_ms = since_ns // _MS
    runs: dict[str, list[tuple[int, str | None]]] = {}
    present: set[str] = set()
    for report in found.reports:
        label_of, reasons = standing(report)
        at_ms = max(begins_ms, round(report.time.timestamp() * 1000))
        for robot in present - label_of.keys() - reasons.keys():
            runs[robot].append((at_ms, ABSENT))
        present = label_of.keys() | reasons.keys()
        for robot in present:
            told, label = runs.setdefault(robot, []), label_of.get(robot)
            if not told or told[-1][1] != label:
                told.append((at_ms, label))
    return {
        "since_ms": begins_ms,
        "until_ms": until_ns // _MS,
        "thinned": found.thinned,
        "robots": order(runs, until_ns // _MS),
        "runs": runs,
        "gaps": [
            {"since_ms": _ms(gap.since.timestamp()), "until_ms": _ms(gap.until.timestamp()), "reason": gap.reason}
            for gap in found.gaps
        ],
    }


def revisions(archive: Archive, since_ns: int, until_ns: int) -> Revisions:
    """All revisions of a time where they are few, else those at moments that are evenly apart."""
    before = archive.groups_at(since_ns)
    first = [] if before is None else [before]
    found: list[GroupsReport] = []
    gaps: list[Gap] = []
    cursor: str | None = None
    newest = archive.groups_at(until_ns)
    # The history may begin within the time, and swarms grow.
    size = max(1, _read(first), 0 if newest is None else _read([newest]))
    limit = max(1, min(_PAGE, _CELLS // size))
    while True:
        page = archive.groups(since_ns, until_ns, cursor, limit)
        found += page.items
        gaps += [gap for gap in page.gaps if gap not in gaps]
        cursor = page.next
        if cursor is None:
            return Revisions((*first, *found), tuple(gaps[:_MOST_GAPS]), thinned=False)
        if _read(found) >= _CELLS:
            return _thinned(archive, since_ns, until_ns, first, size)


def order(runs: dict[str, list[tuple[int, str | None]]], until_ms: int) -> list[str]:
    """Robots so that those stand beside each other that were in one group for long (average linkage)."""
    robots = sorted(runs, key=_natural)
    if len(robots) < 3:
        return robots
    if len(robots) > _MANY:
        # What follows takes the square of them, each time that somebody looks.
        return sorted(robots, key=lambda robot: _last_label(runs[robot]))
    together = _together([runs[robot] for robot in robots], until_ms)
    apart = 1.0 - together
    np.fill_diagonal(apart, 0.0)
    # Who come close in name come first where nothing else tells.
    places = np.arange(len(robots))
    apart += 1e-6 * np.abs(places[:, None] - places[None, :])
    tree = linkage(squareform(apart, checks=False), "average", optimal_ordering=len(robots) <= _FEW)
    leaves = leaves_list(tree)
    blocks: list[list[int]] = []
    for k in leaves.tolist():
        if blocks and together[blocks[-1][0], k] >= _ALIKE:
            blocks[-1].append(k)
        else:
            blocks.append([k])
    if min(blocks[0]) > min(blocks[-1]):
        blocks.reverse()
    return [robots[k] for block in blocks for k in sorted(block)]


def _thinned(archive: Archive, since_ns: int, until_ns: int, first: list[GroupsReport], size: int) -> Revisions:
    """What was in force as each part of the time ended, so that what stood for long is never missed."""
    moments = max(20, min(_MOMENTS, _CELLS // size))
    found = list(first)
    gaps: list[Gap] = []
    for k in range(moments):
        begin, end = (since_ns + (until_ns - since_ns) * step // moments for step in (k, k + 1))
        gaps += [gap for gap in archive.groups(begin, end, None, 1).gaps if gap not in gaps]
        last = archive.groups_at(end)
        if last is not None and (not found or last.revision != found[-1].revision):
            found.append(last)
    return Revisions(tuple(found), tuple(gaps[:_MOST_GAPS]), thinned=True)


def _read(found: Sequence[GroupsReport]) -> int:
    return sum(1 + len(report.ungrouped) + sum(len(group.robots) for group in report.groups) for report in found)


def _together(runs: Sequence[Sequence[tuple[int, str | None]]], until_ms: int) -> Floats:
    """Share (N, N) of the time in which both stood in one group, of that in which either stood in any."""
    times = sorted({at_ms for each in runs for at_ms, _ in each})[-_MOMENTS:]
    labels = np.zeros((len(runs), len(times)), np.int64)
    numbers: dict[str | None, int] = {None: 0, ABSENT: 0}
    for robot, each in enumerate(runs):
        for at_ms, label in each:
            labels[robot, np.searchsorted(times, at_ms) :] = numbers.setdefault(label, len(numbers))
    lasts = np.diff(np.array([*times, max(until_ms, times[-1] + 1)], np.float64))
    shared = np.zeros((len(runs), len(runs)))
    for column, seconds in zip(labels.T, lasts, strict=True):
        grouped = column > 0
        shared += seconds * ((column[:, None] == column[None, :]) & grouped[:, None] & grouped[None, :])
    own = np.diag(shared)
    either = np.maximum(own[:, None] + own[None, :] - shared, 1e-9)
    return np.asarray(np.clip(shared / either, 0.0, 1.0), np.float64)


def _last_label(runs: Sequence[tuple[int, str | None]]) -> tuple[bool, list[tuple[bool, int, str]]]:
    """The group that a robot stood in last, to sort by; who stood in none come last."""
    label = runs[-1][1]
    return not label, _natural(label or "")


def _natural(name: str) -> list[tuple[bool, int, str]]:
    """r2 before r10."""
    return [(not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in re.split(r"(\d+)", name) if part]


def _ms(seconds: float) -> int:
    return round(1000 * seconds)

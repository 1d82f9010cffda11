"""How still do groups stand while a robot drives from one to another, and all overlaps are noisy?

Cameras look down from above in planted groups; robot 0, the mover, drives from the first group to the second. Every
step, one a second, measures all overlaps anew, and one pair, the last two robots, flickers: its images match or do not.
What the criterion says of the true overlaps tells which changes are the mover's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import pdist, squareform

from covista_service.drawing import timeline
from covista_service.grouping.continuity import Grouping, follow
from covista_service.grouping.hysteresis import HysteresisOptions, Pending, held, weigh
from covista_service.grouping.k_means import Labels, dense
from covista_service.grouping.selection import Criterion, SelectionOptions, choose, contributions
from covista_service.grouping.similarity import Floats, matrix

COUNTS = (10, 30, 100)
STEPS = 101
NOISE = 0.05
# Of the newest measurement of a pair's overlaps, if they are smoothed.
NEWEST = 0.3
ALPHA = 0.5
_STEP_NS = 1_000_000_000
# Side of the square that a camera sees.
_FOOTPRINT_M = 9.3
# Between the middles of neighbouring groups, and from there to a group's rim.
_SPACING_M = 11.0
_RADIUS_M = 1.6
# The pair that flickers: so far apart that its overlap decides.
_PAIR_M = 3.5
_PAIR_OVERLAPS = (0.1, 0.6)
# The mover stands, drives, and stands again.
_LEAVES, _ARRIVES = 0.2, 0.8
_LEAST_GROUP = 3
_NOWHERE = -1
# Where the mover goes.
_GOAL = 1


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """Distances in metres, true and measured overlaps, each (T, N, N), and who was planted in which group (N,)."""

    distance_m: Floats
    true: Floats
    measured: Floats
    planted: Labels


@dataclass(frozen=True, slots=True)
class Setting:
    """How what is proposed comes to be shown: as it is (None) or by hysteresis, from smoothed overlaps or not."""

    name: str
    hysteresis: HysteresisOptions | None
    smoothed: bool


@dataclass(frozen=True, slots=True)
class Row:
    """What a setting does, as means over drives.

    Changes are labels of robots that are not what they were a step before; `others` are those of all but the mover,
    and `true` all that the true overlaps make. `lag` is how many steps after the truth the mover is shown with the
    group that it drives to; `astray` the share of steps in which it is not with the group with which it truly is.
    """

    criterion: Criterion
    robots: int
    setting: str
    changes_per_100: float
    others_per_100: float
    true_per_100: float
    lag_steps: float
    astray: float


_DEFAULT = HysteresisOptions()
_HELD = replace(_DEFAULT, persistence_s=0.0)
_CLEAR = replace(_DEFAULT, gain=0.0, persistence_s=np.inf)
_PERSISTENT = replace(_DEFAULT, gain=0.0, clear=np.inf)
SETTINGS = tuple(
    Setting(name + (", smoothed" if smoothed else ""), options, smoothed)
    for smoothed in (False, True)
    for name, options in {
        "as proposed": None,
        "held": _HELD,
        "clear gain": _CLEAR,
        "persistence": _PERSISTENT,
        "hysteresis": _DEFAULT,
    }.items()
)


def drive(count: int, rng: np.random.Generator, steps: int = STEPS) -> Drive:
    """`count` robots: a mover, planted groups of three and more, and a pair that flickers."""
    planted, start_m, goal_m = _layout(count, rng)
    position_m = np.repeat(start_m[None], steps, axis=0)
    done = np.clip((np.linspace(0, 1, steps) - _LEAVES) / (_ARRIVES - _LEAVES), 0, 1)[:, None]
    position_m[:, 0] += done * (goal_m - start_m[0])
    apart_m = np.abs(position_m[:, :, None] - position_m[:, None])
    true = np.clip(1 - apart_m / _FOOTPRINT_M, 0, None).prod(axis=3)
    true[:, -1, -2] = true[:, -2, -1] = np.mean(_PAIR_OVERLAPS)
    measured = true.copy()
    measured[:, -1, -2] = measured[:, -2, -1] = rng.choice(_PAIR_OVERLAPS, steps)
    noise = np.triu(rng.normal(0, NOISE, true.shape), 1)
    measured = np.clip(measured + noise + noise.transpose(0, 2, 1), 0, 1)
    measured[:, np.arange(count), np.arange(count)] = 1.0
    distance_m = np.stack([squareform(pdist(place)) for place in position_m])
    return Drive(distance_m, true, measured, planted)


def smoothed(overlap: Floats, newest: float = NEWEST) -> Floats:
    """Overlaps (T, N, N) of each pair, exponentially smoothed over time."""
    result = overlap.copy()
    for t in range(1, len(result)):
        result[t] = newest * overlap[t] + (1 - newest) * result[t - 1]
    return result


def labels_over_time(
    distance_m: Floats, overlap: Floats, options: SelectionOptions, hysteresis: HysteresisOptions | None
) -> Labels:
    """The numbers (T, N) of the labels that robots are shown with."""
    robots = [f"r{number:03}" for number in range(overlap.shape[1])]
    shown: Grouping = {}
    next_label, pending = 1, tuple[Pending, ...]()
    numbers = np.empty(overlap.shape[:2], np.intp)
    before = np.arange(len(robots))
    for t in range(len(numbers)):
        S = matrix(distance_m[t], overlap[t], ALPHA, "shared")
        # Compared with nothing, what is proposed is shown.
        against = {} if hysteresis is None else shown
        if hysteresis is not None and shown:
            S = held(S, before, hysteresis.gain)
        proposed, score_of = choose(S, options, before).labels, contributions(S, options)
        standing = weigh(against, robots, proposed, score_of, t * _STEP_NS, hysteresis or _DEFAULT, pending)
        pending = standing.pending
        following = follow(shown, standing.clusters, next_label)
        shown, next_label = following.groups, following.next_label
        label_of = {robot: int(label[1:]) for label, members in shown.items() for robot in members}
        numbers[t] = [label_of[robot] for robot in robots]
        before = dense(numbers[t])
    return numbers


def rows(
    options: SelectionOptions,
    counts: Sequence[int] = COUNTS,
    drives: int = 8,
    settings: Sequence[Setting] = SETTINGS,
    seed: int = 0,
) -> list[Row]:
    """A row for every number of robots and setting, each the mean over as many drives, the same for all settings."""
    found = []
    for count in counts:
        by_setting: dict[str, list[tuple[float, ...]]] = {setting.name: [] for setting in settings}
        for number in range(drives):
            driven = drive(count, np.random.default_rng((seed, count, number)))
            true = labels_over_time(driven.distance_m, driven.true, options, None)
            for setting in settings:
                by_setting[setting.name].append(_judged(driven, true, _shown(driven, options, setting)))
        found += [
            Row(options.criterion, count, name, *np.mean(values, axis=0).tolist())
            for name, values in by_setting.items()
        ]
    return found


def timelines(
    options: SelectionOptions, count: int = 30, seed: int = 0, settings: Sequence[Setting] = (SETTINGS[0], SETTINGS[-1])
) -> dict[str, Labels]:
    """The label numbers (T, N) of one drive in several settings, robots in the order of their planted groups."""
    driven = drive(count, np.random.default_rng((seed, count, 0)))
    return {setting.name: _shown(driven, options, setting) for setting in settings}


def plot(lines: Mapping[str, Labels]) -> bytes:
    """Time lines as PNG: the mover is the first row, the pair that flickers the last two."""
    count = next(iter(lines.values())).shape[1]
    marked = {0: "mover", count - 2: "pair", count - 1: "pair"}
    panels = {f"{name}: {_changes(labels)} changes": labels for name, labels in lines.items()}
    title = f"Labels of {count} robots, one of which drives from the first group to the second (grey: alone)"
    return timeline.bands(panels, marked, title, "step (1 s)")


def _layout(count: int, rng: np.random.Generator) -> tuple[Labels, Floats, Floats]:
    """Who is in which group (N,), where everybody stands (N, 2), and where the mover goes (2,)."""
    groups = max(2, (count - 3) // (_LEAST_GROUP + 1))
    sizes = np.full(groups, _LEAST_GROUP)
    np.add.at(sizes, rng.integers(groups, size=count - 3 - sizes.sum()), 1)
    planted = np.concatenate([[0], np.repeat(np.arange(groups), sizes), [groups, groups]])
    side = int(np.ceil(np.sqrt(groups + 1)))
    line, place = np.divmod(np.arange(groups + 1), side)
    # To and fro, so that the second group is always next to the first.
    middle_m = _SPACING_M * np.stack([np.where(line % 2, side - 1 - place, place), line], axis=1)
    middle_m = middle_m + rng.uniform(-1, 1, middle_m.shape)
    radius_m, angle = _RADIUS_M * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    position_m = middle_m[planted] + radius_m[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    position_m[-2:] = middle_m[-1] + np.array([(-_PAIR_M / 2, 0.0), (_PAIR_M / 2, 0.0)])
    return planted, position_m, middle_m[1]


def _shown(driven: Drive, options: SelectionOptions, setting: Setting) -> Labels:
    overlap = smoothed(driven.measured) if setting.smoothed else driven.measured
    return labels_over_time(driven.distance_m, overlap, options, setting.hysteresis)


def _changes(labels: Labels) -> int:
    return int((labels[1:] != labels[:-1]).sum())


def _judged(driven: Drive, true: Labels, shown: Labels) -> tuple[float, float, float, float, float]:
    """The numbers of a row for label numbers (T, N): true ones, and as shown."""
    steps = len(shown) - 1
    truly, home = _homes(true, driven.planted), _homes(shown, driven.planted)
    lags = _lags(truly, home)
    changes = [100 * _changes(labels) / steps for labels in (shown, shown[:, 1:], true)]
    return changes[0], changes[1], changes[2], lags, float((truly != home).mean())


def _homes(labels: Labels, planted: Labels) -> Labels:
    """With which planted group the mover is (T,): the one more than half of which has its label."""
    homes = np.full(len(labels), _NOWHERE)
    for group in range(int(planted.max())):
        with_it = labels[:, 1:][:, planted[1:] == group] == labels[:, :1]
        homes[with_it.mean(axis=1) > 0.5] = group
    return homes


def _lags(truly: Labels, home: Labels) -> float:
    """Mean number of steps until the mover is shown with the group that it drives to, or has truly left it again."""
    lags = []
    joins = np.flatnonzero((truly[1:] != truly[:-1]) & (truly[1:] == _GOAL)) + 1
    for t in joins.tolist():
        stay = np.flatnonzero(truly[t:] != truly[t])
        until = len(truly) if not len(stay) else t + int(stay[0])
        there = np.flatnonzero(home[t:until] == truly[t])
        lags.append(int(there[0]) if len(there) else until - t)
    return float(np.mean(lags)) if lags else 0.0

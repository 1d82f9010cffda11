"""What every robot's keyframes show: poses that agree with the images, and surfaces that all pairs feed."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from covista_service.perception.adjustment import AdjustmentOptions
from covista_service.perception.agreement import Observations
from covista_service.perception.camera import Pose, View, relative
from covista_service.perception.scales import parts_of, ratio_range, scale_sigmas
from covista_service.perception.scene import Evidence, Settled, Sight
from covista_service.perception.surface import Surface
from covista_service.perception.visibility import SAME_SCALE, Mask, Seeing, VisibilityOptions, seen
from covista_service.perception.warp import Carried
from covista_service.station.agreements import Agreements
from covista_service.station.events import BuildSurfaces, Keyframe, KeyframeId, SurfacesBuilt

# Depths that keyframes replaced since have given to one that is still in use.
_BESIDE = 8
# Earlier keyframes of a robot that its next ones are held against.
_WINDOW = 4
# A robot's own motion tells depths if it is so large a share of the depth; the nearest to the middle is taken.
_LEAST_BASELINE, _BEST_BASELINE, _MOST_BASELINE = 0.02, 0.1, 0.4

# A robot alone has seen others before, or moved itself: the scale of its depths is not just any.
_MOST_SCALE = 0.15

Names = tuple[KeyframeId, KeyframeId]
# Least and greatest ratio of the scales of two keyframes' depths.
Ratios = tuple[float, float]
Depths = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """A keyframe, the pose that stands for it, its surface, and how many points of its own that rests on.

    `matched`: keyframes that share matched points with it, and how many. `depths_m`: how near its surface is (5 %), its
    median and how far (95 %).
    """

    keyframe: Keyframe
    pose: Pose
    surface: Surface
    points: int
    matched: Mapping[KeyframeId, int]
    depths_m: Depths


@dataclass(slots=True, eq=False)
class _Study:
    """What is known of a robot: `keyframe` is the newest in use, `outlook` the newest that has a surface.

    `carried` is what the robot saw before that keyframe.
    """

    keyframe: Keyframe
    pose: Pose
    outlook: Outlook | None = None
    carried: Carried | None = None
    beside: dict[KeyframeId, Observations] = field(default_factory=dict)
    earlier: deque[Keyframe] = field(default_factory=lambda: deque(maxlen=_WINDOW))

    def find(self, name: KeyframeId) -> Keyframe | None:
        """The keyframe of this name, if it is still held."""
        return next((one for one in (self.keyframe, *self.earlier) if one.id == name), None)

    def lay_beside(self, name: KeyframeId, said: Observations) -> None:
        """Keep depths that a replaced keyframe has given."""
        if len(said):
            self.beside[name] = said
            while len(self.beside) > _BESIDE:
                del self.beside[next(iter(self.beside))]


class Outlooks:
    """Outlooks by robot, the evidence between keyframes in use, and what is to be built."""

    def __init__(self) -> None:
        self._studies: dict[str, _Study] = {}
        self._evidence: dict[Names, Evidence] = {}
        # The same by keyframe, in order of arrival.
        self._names: dict[KeyframeId, dict[Names, None]] = {}
        # Robots whose surface is to be built anew, keyframes at a worker, and jobs under way.
        self._stale: dict[str, None] = {}
        self._at_work: dict[str, KeyframeId] = {}
        self._agreements = Agreements()
        self._scales: Scales | None = None
        self.under_way = 0

    def __getitem__(self, robot: str) -> Outlook | None:
        study = self._studies.get(robot)
        return None if study is None else study.outlook

    def __iter__(self) -> Iterator[Outlook]:
        return (study.outlook for study in self._studies.values() if study.outlook is not None)

    def building(self, name: KeyframeId) -> bool:
        """Is the surface of this keyframe on its way?"""
        return self._at_work.get(name.robot) == name

    def keyframe(self, keyframe: Keyframe) -> Keyframe | None:
        """Take a robot's new keyframe; the earlier one to hold it against, if its motion tells depths."""
        robot = keyframe.id.robot
        held = self._studies.get(robot)
        study = self._studies[robot] = _Study(keyframe, keyframe.pose)
        if held is None:
            return None
        study.outlook, study.earlier = held.outlook, held.earlier
        if held.outlook is not None:
            study.carried = _carried(held.outlook.surface, held.outlook.keyframe, keyframe)
        study.earlier.append(replace(held.keyframe, image=None))
        self._retire(held.keyframe.id)
        return None if held.outlook is None else _partner(keyframe, study.earlier, held.outlook.depths_m[1])

    def surveyed(self, first: KeyframeId, second: KeyframeId, evidence: Evidence | None) -> None:
        """Take what a survey found, None if it failed; surfaces of its keyframes still in use are to be built anew."""
        current = [name for name in (first, second) if self._current(name)]
        if evidence is not None and current:
            self._put((first, second), evidence)
            if len(current) == 2 and evidence.link is not None and self._as_reported(*current):
                self._agreements.note(first, second, agree=not evidence.link.contradicts)
        for name in current:
            self._stale.setdefault(name.robot)

    def pose(self, keyframe: Keyframe) -> Pose:
        """The pose that stands for a keyframe."""
        study = self._studies.get(keyframe.id.robot)
        if study is None:
            return keyframe.pose
        if study.keyframe.id == keyframe.id:
            return study.pose
        held = study.outlook
        return held.pose if held is not None and held.keyframe.id == keyframe.id else keyframe.pose

    def start(self, hands: int) -> list[BuildSurfaces]:
        """At most so many jobs, under way from now on. Two robots whose images contradict each other go together."""
        jobs: list[BuildSurfaces] = []
        for robot in list(self._stale):
            if len(jobs) >= hands:
                break
            if robot in self._stale and robot not in self._at_work and not self._waits(robot):
                together = [robot, *self._fresh_partner(robot)]
                for one in together:
                    self._stale.pop(one, None)
                    self._at_work[one] = self._studies[one].keyframe.id
                jobs.append(self._job(together))
        self.under_way += len(jobs)
        return jobs

    def built(self, event: SurfacesBuilt) -> list[Keyframe]:
        """Take what was built; the keyframes that have an outlook of their own since."""
        self.under_way -= 1
        opened = [(k, name) for k, name in enumerate(event.job.keyframes) if event.job.sights[k].open]
        for _, name in opened:
            self._at_work.pop(name.robot, None)
        if event.settled is None:
            return []
        matched = _matched(event)
        for (i, j), said in event.evidence.items():
            self._keep((event.job.keyframes[i], event.job.keyframes[j]), said)
        taken = [self._take(name, event.settled[k], matched.get(k, {})) for k, name in opened]
        return [keyframe for keyframe in taken if keyframe is not None]

    def scales(self) -> Scales:
        """Which robots' depths have one scale, and how well each is known; made anew when an outlook is."""
        if self._scales is None:
            self._scales = self._weighed()
        return self._scales

    def _weighed(self) -> Scales:
        outlooks = list(self)
        index = {outlook.keyframe.id.robot: k for k, outlook in enumerate(outlooks)}
        joined = [
            (k, index[other.robot])
            for k, outlook in enumerate(outlooks)
            for other in outlook.matched
            if other.robot in index
        ]
        return Scales(outlooks, joined)

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        study = self._studies.pop(robot, None)
        self._stale.pop(robot, None)
        self._agreements.forget(robot)
        self._scales = None
        if study is not None:
            self._retire(study.keyframe.id)

    def _as_reported(self, *names: KeyframeId) -> bool:
        return all(self._studies[name.robot].pose is self._studies[name.robot].keyframe.pose for name in names)

    def _current(self, name: KeyframeId) -> bool:
        study = self._studies.get(name.robot)
        return study is not None and study.keyframe.id == name

    def _put(self, names: Names, said: Evidence) -> None:
        self._evidence[names] = said
        for name in names:
            self._names.setdefault(name, {})[names] = None

    def _drop(self, names: Names) -> Evidence:
        for name in names:
            beside = self._names[name]
            beside.pop(names)
            if not beside:
                del self._names[name]
        return self._evidence.pop(names)

    def _keep(self, names: Names, said: Evidence) -> None:
        """Keep what a job made of evidence: with keyframes that are replaced, the depths alone."""
        if names not in self._evidence:
            return
        self._put(names, said)
        for name in names:
            if not self._current(name):
                self._retire(name)

    def _retire(self, name: KeyframeId) -> None:
        """Drop the evidence of a keyframe that is in use no longer; the depths that it gave to others stay with them.

        What no surface has been built with yet waits for that.
        """
        for names in list(self._names.get(name, ())):
            side = 1 - names.index(name)
            said, other = self._evidence[names], names[side]
            if not self._current(other):
                self._drop(names)
            elif said.observed is not None:
                self._drop(names)
                self._studies[other.robot].lay_beside(name, said.observed[side])

    def _waits(self, robot: str) -> bool:
        """Is one whose images contradict this robot's at a worker? The two are settled together, or not at all."""
        name = self._studies[robot].keyframe.id
        return any(
            said.observed is None
            and said.link is not None
            and said.link.contradicts
            and any(one.robot != robot and one.robot in self._at_work for one in names)
            for names in self._names.get(name, ())
            for said in (self._evidence[names],)
        )

    def _fresh_partner(self, robot: str) -> list[str]:
        """Another robot that is stale too, by a survey of the two that no surface has been built with yet."""
        name = self._studies[robot].keyframe.id
        for names in reversed(self._names.get(name, {})):
            if self._evidence[names].observed is None:
                other = names[1 - names.index(name)].robot
                if other != robot and other in self._stale and other not in self._at_work:
                    return [other]
        return []

    def _job(self, robots: list[str]) -> BuildSurfaces:
        """The robots' keyframes, open, among all that there is evidence with."""
        opened = [self._studies[robot].keyframe for robot in robots]
        held = {keyframe.id: keyframe for keyframe in opened}
        evidence: dict[Names, Evidence] = {}
        for names in list(dict.fromkeys(names for keyframe in opened for names in self._names.get(keyframe.id, ()))):
            pair = [self._find(name) for name in names]
            if None in pair:  # replaced so often that it is held no longer
                self._drop(names)
                continue
            held.update({keyframe.id: keyframe for keyframe in pair if keyframe is not None})
            evidence[names] = self._evidence[names]
        index = {name: k for k, name in enumerate(held)}
        count, borne_out = len(opened), self._agreements.borne_out(lambda name: self._find(name) is not None)
        return BuildSurfaces(
            tuple(held),
            tuple(
                self._sight(keyframe, among=k < count, firm=keyframe.id.robot in borne_out)
                for k, keyframe in enumerate(held.values())
            ),
            tuple(keyframe.thumbnail if k < count else None for k, keyframe in enumerate(held.values())),
            {(index[first], index[second]): said for (first, second), said in evidence.items()},
        )

    def _find(self, name: KeyframeId) -> Keyframe | None:
        study = self._studies.get(name.robot)
        return None if study is None else study.find(name)

    def _sight(self, keyframe: Keyframe, *, among: bool, firm: bool) -> Sight:
        """A keyframe for a job, `among` those that are to be built or only beside them."""
        study = self._studies[keyframe.id.robot]
        beside = tuple(study.beside.values()) if among else ()
        carried = study.carried if among else None
        view, former = view_of(keyframe, keyframe.pose), _own(study, keyframe)
        return Sight(view, self.pose(keyframe), among, beside, former, carried, firm)

    def _take(self, name: KeyframeId, settled: Settled, matched: Mapping[KeyframeId, int]) -> Keyframe | None:
        study = self._studies.get(name.robot)
        if study is None or settled.surface is None:
            return None
        keyframe, held = study.find(name), study.outlook
        if keyframe is None or (held is not None and held.keyframe.arrived_ns > keyframe.arrived_ns):
            return None
        if keyframe is study.keyframe:
            study.pose = settled.pose
        else:
            # A newer one has come meanwhile: that is what its robot saw before.
            study.carried = _carried(settled.surface, keyframe, study.keyframe)
        self._scales = None
        beside = {other: len(said) for other, said in study.beside.items()} if keyframe is study.keyframe else {}
        points, depths_m = len(settled.points), _depths_m(settled.surface)
        study.outlook = Outlook(keyframe, settled.pose, settled.surface, points, {**beside, **matched}, depths_m)
        return keyframe


def view_of(keyframe: Keyframe, pose: Pose) -> View:
    """What the maths needs of a keyframe, at this pose. Raises ValueError while it has no features."""
    if keyframe.features is None:
        raise ValueError(f"{keyframe.id} has no features yet")
    return View(keyframe.camera, pose, keyframe.features)


class Scales:
    """The scale of every robot's depths: one for all that are connected by matches, if by way of others."""

    def __init__(self, outlooks: Sequence[Outlook], joined: Sequence[tuple[int, int]]) -> None:
        """`joined`: indices of outlooks that share matched points."""
        parts = parts_of(len(outlooks), joined)
        centres = np.array([outlook.pose.centre_m for outlook in outlooks]).reshape(-1, 3)
        depths = np.array([outlook.depths_m[1] for outlook in outlooks])
        known = scale_sigmas(centres, depths, parts, AdjustmentOptions().position_share)
        self._known = np.minimum(known, _MOST_SCALE)
        self._parts = parts
        self._index = {outlook.keyframe.id.robot: k for k, outlook in enumerate(outlooks)}

    def ratios(self, one: str, other: str) -> Ratios:
        """Least and greatest ratio of two robots' scales."""
        i, j = self._index[one], self._index[other]
        if self._parts[i] == self._parts[j]:
            return SAME_SCALE
        return ratio_range(self._known[i], self._known[j], VisibilityOptions().scale_sigmas)


def masks(first: Outlook, second: Outlook, ratios: Ratios) -> tuple[Mask, Mask]:
    """Which cells (ROWS, COLUMNS) of either image the other camera sees."""
    rotation, translation = relative(first.pose, second.pose)
    one, other = (Seeing(outlook.keyframe.camera, outlook.surface) for outlook in (first, second))
    options = VisibilityOptions()
    return (
        seen(one, other, rotation, translation, options, ratios=ratios),
        seen(other, one, rotation.T, -rotation.T @ translation, options, ratios=_inverse(ratios)),
    )


def _inverse(ratios: Ratios) -> Ratios:
    return 1 / ratios[1], 1 / ratios[0]


def _carried(surface: Surface, seen: Keyframe, to: Keyframe) -> Carried:
    return Carried(surface, seen.camera, *relative(seen.pose, to.pose))


def _own(study: _Study, keyframe: Keyframe) -> Surface | None:
    outlook = study.outlook
    return outlook.surface if outlook is not None and outlook.keyframe.id == keyframe.id else None


def _matched(event: SurfacesBuilt) -> dict[int, dict[KeyframeId, int]]:
    """For each keyframe of a job by index, those that it shares points with, and how many."""
    matched: dict[int, dict[KeyframeId, int]] = {}
    for (i, j), said in event.evidence.items():
        if said.matched:
            matched.setdefault(i, {})[event.job.keyframes[j]] = said.matched
            matched.setdefault(j, {})[event.job.keyframes[i]] = said.matched
    return matched


def _depths_m(surface: Surface) -> Depths:
    near, median, far = 1.0 / np.percentile(surface.inverse_depth, (95, 50, 5))
    return float(near), float(median), float(far)


def _partner(keyframe: Keyframe, earlier: deque[Keyframe], depth_m: float) -> Keyframe | None:
    """The earlier keyframe whose place gives the best parallax, None if all are too near or too far."""
    best: tuple[float, Keyframe] | None = None
    for other in earlier:
        baseline = float(np.linalg.norm(other.pose.centre_m - keyframe.pose.centre_m)) / depth_m
        off = abs(np.log(max(baseline, _LEAST_BASELINE / 2) / _BEST_BASELINE))
        if _LEAST_BASELINE <= baseline <= _MOST_BASELINE and (best is None or off < best[0]):
            best = (off, other)
    return None if best is None else best[1]

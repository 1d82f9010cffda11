"""What every robot's keyframes show: poses that agree with the images, and surfaces that all pairs feed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from covista_service.perception.camera import Pose
from covista_service.perception.scene import Evidence, Settled, Sight
from covista_service.station.agreements import Agreements
from covista_service.station.events import BuildSurfaces, Keyframe, KeyframeId, SurfacesBuilt
from covista_service.station.options import NS_PER_S
from covista_service.station.outlook import Outlook, depths_m, view_of
from covista_service.station.scales import Scales
from covista_service.station.study import Study
from covista_service.station.testimony import Names, Testimony, contradicts, matched

# What further surveys tell of a keyframe that has a surface is put into it together: when hands have nothing else to
# do, or after so long.
_TOGETHER_NS = 3 * NS_PER_S // 10


class Outlooks:
    """Outlooks by robot, the evidence between keyframes in use, and what is to be built.

    The work of every call follows what a robot has to do with others, not how many there are.
    """

    def __init__(self) -> None:
        self._studies: dict[str, Study] = {}
        self._testimony = Testimony()
        # Robots whose surface is to be built anew, since when; keyframes at a worker, and jobs under way.
        self._stale: dict[str, int] = {}
        self._at_work: dict[str, KeyframeId] = {}
        self._agreements = Agreements()
        self.scales = Scales()
        self.under_way = 0

    def __getitem__(self, robot: str) -> Outlook | None:
        study = self._studies.get(robot)
        return None if study is None else study.outlook

    def building(self, name: KeyframeId) -> bool:
        """Is the surface of this keyframe on its way?"""
        return self._at_work.get(name.robot) == name

    def awaited(self, robot: str) -> bool:
        """Is a robot's surface on its way, or next in turn?"""
        return robot in self._stale or robot in self._at_work

    def keyframe(self, keyframe: Keyframe) -> Keyframe | None:
        """Take a robot's new keyframe; the earlier one to hold it against, if its motion tells depths."""
        robot = keyframe.id.robot
        held = self._studies.get(robot)
        study = self._studies[robot] = Study(keyframe, keyframe.pose)
        if held is None:
            return None
        study.outlook, study.earlier = held.outlook, held.earlier
        if held.outlook is not None:
            study.carry(held.outlook.surface, held.outlook.keyframe)
        study.earlier.append(replace(held.keyframe, image=None))
        self._retire(held.keyframe.id)
        return study.partner()

    def surveyed(self, first: KeyframeId, second: KeyframeId, evidence: Evidence | None, now_ns: int) -> None:
        """Take what a survey found, None if it failed; surfaces of its keyframes still in use are to be built anew."""
        current = [name for name in (first, second) if self._current(name)]
        if evidence is not None and current:
            self._testimony.put((first, second), evidence)
            if len(current) == 2 and evidence.link is not None and self._as_reported(*current):
                self._agreements.note(first, second, agree=not evidence.link.contradicts)
        for name in current:
            self._stale.setdefault(name.robot, now_ns)

    def pose(self, keyframe: Keyframe) -> Pose:
        """The pose that stands for a keyframe."""
        study = self._studies.get(keyframe.id.robot)
        return keyframe.pose if study is None else study.pose_of(keyframe)

    def start(self, hands: int, now_ns: int, urgent: Callable[[KeyframeId], bool] | None = None) -> list[BuildSurfaces]:
        """At most so many jobs, under way from now on. Two robots whose images contradict each other go together.

        With `urgent` only surfaces of keyframes that have none of their own, or that it says this of, or that have
        waited for long.
        """
        if hands <= 0:
            return []
        jobs: list[BuildSurfaces] = []
        for robot in list(self._stale):
            if len(jobs) >= hands:
                break
            if not self._presses(robot, now_ns, urgent):
                continue
            if robot in self._stale and robot not in self._at_work and not self._waits(robot):
                together = [robot, *self._fresh_partner(robot, now_ns, urgent)]
                for one in together:
                    self._stale.pop(one, None)
                    self._at_work[one] = self._studies[one].keyframe.id
                jobs.append(self._job(together))
        self.under_way += len(jobs)
        return jobs

    def built(self, event: SurfacesBuilt, now_ns: int) -> list[Keyframe]:
        """Take what was built; the keyframes that have an outlook of their own since."""
        self.under_way -= 1
        opened = [(k, name) for k, name in enumerate(event.job.keyframes) if event.job.sights[k].open]
        for _, name in opened:
            self._at_work.pop(name.robot, None)
        if event.settled is None:
            return []
        shared = matched(event.job.keyframes, event.evidence)
        for (i, j), said in event.evidence.items():
            self._keep((event.job.keyframes[i], event.job.keyframes[j]), said)
        taken = [self._take(name, event.settled[k], shared.get(k, {}), now_ns) for k, name in opened]
        return [keyframe for keyframe in taken if keyframe is not None]

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        study = self._studies.pop(robot, None)
        self._stale.pop(robot, None)
        self._agreements.forget(robot)
        self.scales.drop(robot)
        if study is not None:
            self._retire(study.keyframe.id)

    def _as_reported(self, *names: KeyframeId) -> bool:
        return all(self._studies[name.robot].as_reported for name in names)

    def _current(self, name: KeyframeId) -> bool:
        study = self._studies.get(name.robot)
        return study is not None and study.keyframe.id == name

    def _keep(self, names: Names, said: Evidence) -> None:
        """Keep what a job made of evidence: with keyframes that are replaced, the depths alone."""
        if names not in self._testimony:
            return
        self._testimony.put(names, said)
        for name in names:
            if not self._current(name):
                self._retire(name)

    def _retire(self, name: KeyframeId) -> None:
        """Drop the evidence of a keyframe that is in use no longer; the depths that it gave to others stay with them.

        What no surface has been built with yet waits for that.
        """
        for names in self._testimony.of(name):
            side = 1 - names.index(name)
            said, other = self._testimony[names], names[side]
            if not self._current(other):
                self._testimony.drop(names)
            elif said.observed is not None:
                self._testimony.drop(names)
                self._studies[other.robot].lay_beside(name, said.observed[side])

    def _presses(self, robot: str, now_ns: int, urgent: Callable[[KeyframeId], bool] | None) -> bool:
        since_ns, study = self._stale.get(robot, now_ns), self._studies[robot]
        fresh = study.outlook is None or study.outlook.keyframe is not study.keyframe
        waited = not 0 <= now_ns - since_ns < _TOGETHER_NS
        return urgent is None or fresh or waited or urgent(study.keyframe.id)

    def _waits(self, robot: str) -> bool:
        """Is one whose images contradict this robot's at a worker? The two are settled together, or not at all."""
        beside = self._testimony.beside(self._studies[robot].keyframe.id)
        return any(
            other.robot != robot and other.robot in self._at_work and contradicts(said) for other, said in beside
        )

    def _fresh_partner(self, robot: str, now_ns: int, urgent: Callable[[KeyframeId], bool] | None) -> list[str]:
        """Another robot that is stale too, by a survey of the two that no surface has been built with yet."""
        for name, said in self._testimony.beside(self._studies[robot].keyframe.id):
            other = name.robot
            ready = said.observed is None and other != robot and other in self._stale and other not in self._at_work
            if ready and (contradicts(said) or self._presses(other, now_ns, urgent)):
                return [other]
        return []

    def _job(self, robots: list[str]) -> BuildSurfaces:
        """The robots' keyframes, open, among all that there is evidence with."""
        opened = [self._studies[robot].keyframe for robot in robots]
        held = {keyframe.id: keyframe for keyframe in opened}
        evidence: dict[Names, Evidence] = {}
        for names in self._testimony.of(*held):
            pair = [self._find(name) for name in names]
            if None in pair:  # replaced so often that it is held no longer
                self._testimony.drop(names)
                continue
            held.update({keyframe.id: keyframe for keyframe in pair if keyframe is not None})
            evidence[names] = self._testimony[names]
        index = {name: k for k, name in enumerate(held)}
        count = len(opened)
        firm = self._agreements.borne_out([name.robot for name in held], lambda name: self._find(name) is not None)
        return BuildSurfaces(
            tuple(held),
            tuple(
                self._sight(keyframe, among=k < count, firm=keyframe.id.robot in firm)
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
        view, former = view_of(keyframe, keyframe.pose), study.surface_of(keyframe)
        return Sight(view, self.pose(keyframe), among, beside, former, carried, firm)

    def _take(
        self, name: KeyframeId, settled: Settled, shared: Mapping[KeyframeId, int], now_ns: int
    ) -> Keyframe | None:
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
            study.carry(settled.surface, keyframe)
        beside = {other: len(said) for other, said in study.beside.items()} if keyframe is study.keyframe else {}
        since_ns = held.since_ns if held is not None and held.keyframe.id == name else now_ns
        study.outlook = Outlook(
            keyframe,
            settled.pose,
            settled.surface,
            len(settled.points),
            {**beside, **shared},
            depths_m(settled.surface),
            since_ns,
        )
        self.scales.put(study.outlook)
        return keyframe

"""A station with hands that answer at once, and rovers that look at a wall."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from covista_service.perception.agreement import DepthPoints, Observations
from covista_service.perception.camera import Camera, Features, Pose
from covista_service.perception.comparison import Comparison
from covista_service.perception.relative_pose import RelativePose
from covista_service.perception.scene import Evidence, Settled
from covista_service.perception.sightings import Sightings
from covista_service.perception.surface import SurfaceOptions, flat
from covista_service.station import prospects
from covista_service.station.events import (
    BuildSurfaces,
    Effect,
    Event,
    ExtractFeatures,
    FeaturesExtracted,
    GroupsEvaluated,
    Happened,
    Keyframe,
    KeyframeArrived,
    KeyframeId,
    MessagesReceived,
    Pair,
    PoseArrived,
    SurfacesBuilt,
    SurveyDone,
    SurveyPair,
    Tick,
)
from covista_service.station.memory import Memory
from covista_service.station.options import StationOptions
from covista_service.station.outlook import Prospect, Ratios
from covista_service.station.pairs import Answer
from covista_service.station.snapshot import Snapshot
from covista_service.station.station import Station

from tests.service.station.remembering import remember

S = 1_000_000_000
START_NS = 1_700_000_000 * S
CAMERA = Camera(np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]), 320, 240)
FEATURES = Features("rootsift", np.zeros((9, 2), np.float32), np.zeros((9, 128), np.uint8))
AHEAD = np.eye(3)
BACK = np.diag([-1.0, 1.0, -1.0])


def pose(x_m: float = 0.0, world_from_camera: np.ndarray = AHEAD) -> Pose:
    return Pose(world_from_camera, np.array([x_m, 0.0, 0.0]))


def comparison(matches: int, *, verified: bool = True, enough: bool = True, comparable: bool = True) -> Comparison:
    """What comparing two keyframes comes to when so many of their keypoints match."""
    indices = np.column_stack((np.arange(matches), np.arange(matches)))
    points = np.zeros((matches, 2))
    pose = RelativePose(np.eye(3), np.array([-1.0, 0, 0]), "reported", np.ones(matches, bool), verified)
    return Comparison(comparable, indices, Sightings(CAMERA, CAMERA, points, points), pose, enough)


@dataclass(frozen=True)
class Found:
    """What hands find of a pair, and the overlaps that its outlooks are to tell; by their geometry if None."""

    comparison: Comparison
    shares: tuple[float, float] | None = None


def measured(q_first: float = 0.5, q_second: float = 0.6) -> Found:
    return Found(comparison(9), (q_first, q_second))


SEEN = Found(comparison(9))
NOTHING = Found(comparison(0, verified=False, enough=False))
Find = Callable[[SurveyPair], Found | None]


@dataclass
class Scene:
    """Drives a station: time stands still unless `wait` passes it, and nothing happens by itself but surfaces.

    Those are built at once: walls `depth_m` ahead of every keyframe that something matches.
    """

    options: StationOptions = field(default_factory=lambda: StationOptions(regroup_after_s=0.0))
    now_ns: int = START_NS
    memory: Memory | None = None
    depth_m: float = 4.0
    shares: dict[Pair, tuple[float, float]] = field(default_factory=dict)
    told: list[Effect] = field(default_factory=list)
    sequences: dict[tuple[str, str, str], int] = field(default_factory=dict)

    @classmethod
    def of(cls, **options: object) -> "Scene":
        return cls(StationOptions(**{"regroup_after_s": 0.0, **options}))

    def __post_init__(self) -> None:
        self.station = Station(self.options, self._read)
        if self.memory is not None:
            self.station.restore(self.memory, self.now_ns)

    def restarted(self, seconds: float = 0.0) -> "Scene":
        """The same rovers, with a station that starts so much later and knows what this one would remember."""
        later_ns = self.now_ns + round(seconds * S)
        return replace(self, now_ns=later_ns, memory=remember(self.snapshot), told=[])

    def receive(self, *events: Event) -> list[Effect]:
        effects = [effect for event in events for effect in self.station.receive(event, self.now_ns)]
        self.told += effects
        return effects

    def tick(self) -> list[Effect]:
        effects = todo = self.receive(Tick())
        while jobs := [effect for effect in todo if isinstance(effect, BuildSurfaces)]:
            for job in jobs:
                effects += self.receive(self.wall_ahead(job))
            todo = self.receive(Tick())
            effects += todo
        return effects

    def wall_ahead(self, job: BuildSurfaces) -> SurfacesBuilt:
        """Every keyframe that matches another sees a wall; what has no match keeps what it had."""
        evidence = {pair: observed(said, self.depth_m) for pair, said in job.evidence.items()}
        settled = []
        for k, sight in enumerate(job.sights):
            count = sum(said.matched for pair, said in evidence.items() if k in pair) + sum(map(len, sight.beside))
            surface = flat(1 / self.depth_m) if count else sight.former
            if surface is None and sight.carried is not None:
                surface = sight.carried.over(sight.view.camera, SurfaceOptions())
            points = DepthPoints(
                np.zeros((count, 2)), *(np.full(count, value) for value in (1 / self.depth_m, 0.01, 1))
            )
            settled.append(Settled(sight.pose, surface, points))
        return SurfacesBuilt(job, tuple(settled), evidence)

    def wait(self, seconds: float) -> list[Effect]:
        self.now_ns += round(seconds * S)
        return self.tick()

    def next_sequence(self, robot: str, boot: str, topic: str) -> int:
        sequence = self.sequences.get((robot, boot, topic), 0)
        self.sequences[robot, boot, topic] = sequence + 1
        return sequence

    def keyframe(
        self,
        robot: str,
        at: Pose | None = None,
        *,
        boot: str = "b0",
        image: bool = False,
        time_ns: int | None = None,
        sequence: int | None = None,
    ) -> Keyframe:
        number = self.next_sequence(robot, boot, "keyframe") if sequence is None else sequence
        return Keyframe(
            KeyframeId(robot, boot, number),
            self.now_ns if time_ns is None else time_ns,
            self.now_ns,
            CAMERA,
            pose() if at is None else at,
            image=b"jpeg" if image else None,
            features=None if image else FEATURES,
        )

    def send(self, robot: str, at: Pose | None = None, **details: object) -> list[Effect]:
        """Announce and deliver a keyframe."""
        keyframe = self.keyframe(robot, at, **details)
        name = (keyframe.id.boot, keyframe.id.sequence)
        announced = MessagesReceived(robot, "keyframe", (name,), name, self.now_ns)
        return self.receive(announced, KeyframeArrived(keyframe))

    def send_pose(
        self, robot: str, at: Pose, *, boot: str = "b0", time_ns: int | None = None, sequence: int | None = None
    ) -> None:
        number = self.next_sequence(robot, boot, "pose") if sequence is None else sequence
        sent_ns = self.now_ns if time_ns is None else time_ns
        self.receive(
            MessagesReceived(robot, "pose", ((boot, number),), (boot, number), self.now_ns),
            PoseArrived(robot, boot, number, sent_ns, self.now_ns, at),
        )

    def work(self, effects: Iterable[Effect], find: Find = lambda job: measured()) -> list[Effect]:
        """Do what is asked, and what follows from it, until nothing is left to do; all that was told."""
        todo, told = list(effects), []
        while todo:
            told += todo
            for effect in todo:
                if isinstance(effect, SurveyPair):
                    told += self.done(effect, find(effect))
                elif isinstance(effect, ExtractFeatures):
                    self.receive(FeaturesExtracted(effect.keyframe.id, FEATURES))
            todo = self.tick()
        return told

    def settle(self, find: Find = lambda job: measured()) -> list[Effect]:
        return self.work(self.tick(), find)

    def done(self, job: SurveyPair, found: Found | None) -> list[Effect]:
        """A worker is back with what it found."""
        pair = (job.first.robot, job.second.robot)
        self.shares.pop(pair, None)
        if found is not None and found.shares is not None:
            self.shares[pair] = found.shares
        return self.receive(SurveyDone(job.first, job.second, None if found is None else found.comparison))

    def _read(
        self,
        seen: Sequence[Prospect],
        pairs: np.ndarray,
        ratios: Sequence[Ratios],
        computed_ns: Sequence[int],
    ) -> list[Answer]:
        answers = prospects.read(seen, pairs, ratios, computed_ns)
        shares = [self.shares.get((answer.first.id.robot, answer.second.id.robot)) for answer in answers]
        return [
            answer if said is None else replace(answer, overlaps=said)
            for answer, said in zip(answers, shares, strict=True)
        ]

    @property
    def snapshot(self) -> Snapshot:
        return self.station.snapshot(self.now_ns)


def observed(said: Evidence, depth_m: float) -> Evidence:
    """Evidence with a depth for each match."""
    count = len(said.matches)
    depths = Observations(np.arange(count), np.full(count, 1 / depth_m), np.full(count, 0.01), np.ones(count, bool))
    return Evidence(said.matches, said.link, (np.eye(3), np.zeros(3)), (depths, depths))


def surveys(effects: Iterable[Effect]) -> list[Pair]:
    """Pairs of robots that were surveyed; a robot's own motion is none."""
    jobs = [job for job in effects if isinstance(job, SurveyPair)]
    return [(job.first.robot, job.second.robot) for job in jobs if job.first.robot != job.second.robot]


def happenings(effects: Iterable[Effect]) -> list[tuple[str, str]]:
    return [(str(effect.kind), effect.text) for effect in effects if isinstance(effect, Happened)]


def evaluated(effects: Iterable[Effect]) -> list[tuple[KeyframeId, int]]:
    return [entry for effect in effects if isinstance(effect, GroupsEvaluated) for entry in effect.keyframes]

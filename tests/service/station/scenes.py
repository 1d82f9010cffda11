"""A station with hands that answer at once, and rovers that look at a wall."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from covista_service.perception.camera import Camera, Features, Pose
from covista_service.perception.survey import Outcome, Survey
from covista_service.station.events import (
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
    SurveyDone,
    SurveyPair,
    Tick,
)
from covista_service.station.options import StationOptions
from covista_service.station.snapshot import Snapshot
from covista_service.station.station import Station

S = 1_000_000_000
START_NS = 1_700_000_000 * S
CAMERA = Camera(np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]), 320, 240)
FEATURES = Features("rootsift", np.zeros((9, 2), np.float32), np.zeros((9, 128), np.uint8))
AHEAD = np.eye(3)
BACK = np.diag([-1.0, 1.0, -1.0])


def pose(x_m: float = 0.0, world_from_camera: np.ndarray = AHEAD) -> Pose:
    return Pose(world_from_camera, np.array([x_m, 0.0, 0.0]))


def measured(q_first: float = 0.5, q_second: float = 0.6, depth_m: float = 4.0) -> Survey:
    depths_m = np.full(20, depth_m)
    return Survey(Outcome.MEASURED, q_first, q_second, inliers=20, depths_first=depths_m, depths_second=depths_m.copy())


NOTHING = Survey(Outcome.FEW_MATCHES, matches=3)


@dataclass
class Scene:
    """Drives a station: time stands still unless `wait` passes it, and nothing happens by itself."""

    station: Station = field(default_factory=lambda: Station(StationOptions(regroup_after_s=0.0)))
    now_ns: int = START_NS
    told: list[Effect] = field(default_factory=list)
    sequences: dict[tuple[str, str, str], int] = field(default_factory=dict)

    @classmethod
    def of(cls, **options: object) -> "Scene":
        return cls(Station(StationOptions(**{"regroup_after_s": 0.0, **options})))

    def receive(self, *events: Event) -> list[Effect]:
        effects = [effect for event in events for effect in self.station.receive(event, self.now_ns)]
        self.told += effects
        return effects

    def tick(self) -> list[Effect]:
        return self.receive(Tick())

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

    def work(
        self, effects: Iterable[Effect], find: Callable[[SurveyPair], Survey | None] = lambda job: measured()
    ) -> list[Effect]:
        """Do what is asked, and what follows from it, until nothing is left to do; all that was told."""
        todo, told = list(effects), []
        while todo:
            told += todo
            for effect in todo:
                if isinstance(effect, SurveyPair):
                    self.receive(SurveyDone(effect.first, effect.second, find(effect)))
                elif isinstance(effect, ExtractFeatures):
                    self.receive(FeaturesExtracted(effect.keyframe.id, FEATURES))
            todo = self.tick()
        return told

    def settle(self, find: Callable[[SurveyPair], Survey | None] = lambda job: measured()) -> list[Effect]:
        return self.work(self.tick(), find)

    @property
    def snapshot(self) -> Snapshot:
        return self.station.snapshot(self.now_ns)


def surveys(effects: Iterable[Effect]) -> list[Pair]:
    return [(job.first.robot, job.second.robot) for job in effects if isinstance(job, SurveyPair)]


def happenings(effects: Iterable[Effect]) -> list[tuple[str, str]]:
    return [(str(effect.kind), effect.text) for effect in effects if isinstance(effect, Happened)]


def evaluated(effects: Iterable[Effect]) -> list[tuple[KeyframeId, int]]:
    return [entry for effect in effects if isinstance(effect, GroupsEvaluated) for entry in effect.keyframes]

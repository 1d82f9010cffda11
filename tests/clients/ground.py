"""The ground as a rover sees it: a real router with subscriptions and a queryable, for tests."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

import zenoh
import zenoh.ext
from covista_schemas import codec, keys
from covista_schemas.messages import Keyframe, PoseUpdate
from covista_schemas.reports import Counters, KeyframeId, OwnGroupReport, Report, RobotReport, Status, time_of
from covista_schemas.zenoh_config import config

DEADLINE_S = 10.0
SITE = "default"


def free_endpoint() -> str:
    """An end point on loopback at which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


def report_on(robot: str, **known: object) -> RobotReport:
    """A report of a robot of which nothing is known but this."""
    nothing = dict.fromkeys(("group", "pose", "camera", "boot", "keyframe", "last_seen", "clock_offset_s"))
    nothing |= dict.fromkeys(("pose_correction", "last_problem"))
    counters = {"keyframes": Counters(), "poses": Counters()}
    return RobotReport.model_validate({"id": robot, "status": Status.LIVE, **nothing, **counters, **known})


class BusyError(Exception):
    """What an answer may raise: too many ask the station."""


class Ground:
    """Hears everything that robots say, and confirms keyframes unless told otherwise."""

    def __init__(
        self,
        endpoint: str,
        *,
        answer: Callable[[str], RobotReport | None] | None = None,
        router: bool = True,
    ) -> None:
        """Without `router`, it is a client of the router at the end point."""
        self.keyframes: list[Keyframe] = []
        self.poses: list[PoseUpdate] = []
        self.samples: list[zenoh.Sample] = []
        self.tokens: set[str] = set()
        self.asked = 0
        self._answer = answer or self.confirming
        self._news = threading.Condition()
        self.session = zenoh.open(
            config("router", listen=[endpoint]) if router else config("client", connect=[endpoint])
        )
        self.session.declare_subscriber(keys.every(SITE, keys.RobotTopic.KEYFRAME), self._hear_keyframe)
        self.session.declare_subscriber(keys.every(SITE, keys.RobotTopic.POSE), self._hear_pose)
        tokens = keys.every(SITE, keys.RobotTopic.ALIVE)
        self._watch = self.session.liveliness().declare_subscriber(tokens, self._hear_token, history=True)
        self.session.declare_queryable(f"covista/{SITE}/station/robots/*", self._hear_query)
        self._publishers: dict[str, zenoh.ext.AdvancedPublisher] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.session.close()

    def wait(self, condition: Callable[[], object]) -> None:
        """Wait until `condition` holds, looking whenever something was heard."""
        with self._news:
            assert self._news.wait_for(condition, DEADLINE_S), (
                f"heard {len(self.keyframes)} keyframes, {len(self.poses)} poses, tokens {self.tokens}"
            )

    def tell_group(self, robot: str, label: str, revision: int = 1) -> None:
        """Publish a robot's own group."""
        self.publish(
            keys.own_group(SITE, robot),
            OwnGroupReport(robot=robot, label=label, robots=[robot], revision=revision, time=time_of(revision)),
        )

    def publish(self, key: str, report: Report) -> None:
        """Publish as the station does: late subscribers get the last value."""
        if key not in self._publishers:
            self._publishers[key] = zenoh.ext.declare_advanced_publisher(
                self.session, key, cache=zenoh.ext.CacheConfig(1), publisher_detection=True
            )
        self._publishers[key].put(report.model_dump_json())

    def confirming(self, robot: str) -> RobotReport | None:
        """The report that confirms what was heard."""
        heard = [KeyframeId(boot=k.boot, sequence=k.sequence) for k in self.keyframes if k.robot == robot]
        return report_on(robot, keyframe=heard[-1], heard=heard[-1], boot=heard[-1].boot) if heard else None

    def _hear_keyframe(self, sample: zenoh.Sample) -> None:
        with self._news:
            self.samples.append(sample)
            self.keyframes.append(codec.decode_keyframe(sample.payload.to_bytes()))
            self._news.notify_all()

    def _hear_pose(self, sample: zenoh.Sample) -> None:
        with self._news:
            self.samples.append(sample)
            self.poses.append(codec.decode_pose(sample.payload.to_bytes()))
            self._news.notify_all()

    def _hear_token(self, sample: zenoh.Sample) -> None:
        with self._news:
            change = self.tokens.add if sample.kind == zenoh.SampleKind.PUT else self.tokens.discard
            change(str(sample.key_expr))
            self._news.notify_all()

    def _hear_query(self, query: zenoh.Query) -> None:
        key = str(query.key_expr)
        problem = '{"title": "Unknown robot", "status": 404}'
        with self._news:
            self.asked += 1
            try:
                report = self._answer(key.rsplit("/", 1)[1])
            except BusyError:
                report, problem = None, '{"title": "Too many ask", "status": 503}'
            self._news.notify_all()
        with query:
            if report is not None:
                query.reply(key, report.model_dump_json())
            else:
                query.reply_err(problem)

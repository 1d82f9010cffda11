"""What Prometheus is told of the station's accounts: read from a snapshot, so that they agree with REST."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from covista_service.station.snapshot import RobotView, Snapshot


def of_station(snapshot: Snapshot, turned_away: Mapping[str, int]) -> CollectorRegistry:
    """A registry of one snapshot; `turned_away` counts messages on no robot's account, by reason."""
    registry = CollectorRegistry()
    registry.register(_Accounts(snapshot, turned_away))
    return registry


class _Accounts(Collector):
    def __init__(self, snapshot: Snapshot, turned_away: Mapping[str, int]) -> None:
        self._snapshot = snapshot
        self._turned_away = turned_away

    def collect(self) -> Iterator[Metric]:
        yield _messages(self._snapshot.robots.values())
        yield _dropped(self._snapshot.robots.values())
        turned_away = CounterMetricFamily(
            "covista_turned_away", "Messages on no robot's account, by reason.", labels=["reason"]
        )
        for reason, count in self._turned_away.items():
            turned_away.add_metric([reason], count)
        yield turned_away
        robots = GaugeMetricFamily("covista_robots", "Robots by presence.", labels=["status"])
        for status, count in Counter(view.status for view in self._snapshot.robots.values()).items():
            robots.add_metric([status], count)
        yield robots
        yield GaugeMetricFamily("covista_groups", "Groups.", value=len(self._snapshot.groups.groups))
        yield GaugeMetricFamily("covista_revision", "Revision of the groups.", value=self._snapshot.groups.revision)


def _messages(robots: Iterable[RobotView]) -> Metric:
    """Of the robots known now: a forgotten robot takes its counts with it, which Prometheus sees as a restart."""
    total: Counter[tuple[str, str]] = Counter()
    for robot in robots:
        for topic, counts in (("keyframe", robot.keyframes), ("pose", robot.poses)):
            for fate in ("received", "used", "replaced", "duplicate", "missing"):
                total[topic, fate] += getattr(counts, fate)
    family = CounterMetricFamily("covista_messages", "Messages of robots, by fate.", labels=["topic", "fate"])
    for labels, count in total.items():
        family.add_metric(labels, count)
    return family


def _dropped(robots: Iterable[RobotView]) -> Metric:
    total: Counter[tuple[str, str]] = Counter()
    for robot in robots:
        for topic, counts in (("keyframe", robot.keyframes), ("pose", robot.poses)):
            for reason, count in counts.dropped.items():
                total[topic, reason] += count
    family = CounterMetricFamily("covista_dropped", "Messages that could not be used.", labels=["topic", "reason"])
    for labels, count in total.items():
        family.add_metric(labels, count)
    return family

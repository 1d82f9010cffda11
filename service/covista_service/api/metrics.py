"""What Prometheus is told of the station and of the parts around it, as they are when it asks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import get_args

from covista_schemas.reports import Health, Status
from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from covista_service.loop import CrewStatus, SinkStatus
from covista_service.loop.vitals import Vitals
from covista_service.station.census import Census
from covista_service.station.events import Topic
from covista_service.station.ledger import Counts
from covista_service.station.snapshot import Reason
from covista_service.station.workload import Workload

_FATES = ("received", "used", "replaced", "duplicate")
# One value, or values by one label or by two.
Samples = float | Mapping[str, float] | Mapping[tuple[str, str], float]


def of_station(census: Census, vitals: Vitals, health: Health) -> CollectorRegistry:
    """A registry of one moment."""
    registry = CollectorRegistry()
    registry.register(_Accounts(census, vitals, health))
    return registry


class _Accounts(Collector):
    def __init__(self, census: Census, vitals: Vitals, health: Health) -> None:
        self._census = census
        self._vitals = vitals
        self._health = health

    def collect(self) -> Iterator[Metric]:
        yield from _messages(self._census.accounts)
        yield from _swarm(self._census)
        yield from _workload(self._census.workload)
        yield from _link(self._vitals)
        yield from _crew(self._vitals.crew)
        yield from _sinks(self._vitals.sinks)
        ready = {name: part.status == "ready" for name, part in self._health.parts.items()}
        yield _gauge("covista_part_ready", "Is this part as it should be? As /readyz has it.", ready, "part")


def _messages(accounts: Mapping[Topic, Counts]) -> Iterator[Metric]:
    fates: dict[tuple[str, str], float] = {
        (topic, fate): getattr(counts, fate) for topic, counts in accounts.items() for fate in _FATES
    }
    yield _counter("covista_messages", "Messages of robots, by fate.", fates, "topic", "fate")
    dropped: dict[tuple[str, str], float] = {
        (topic, reason): count for topic, counts in accounts.items() for reason, count in counts.dropped.items()
    }
    yield _counter("covista_dropped", "Messages that could not be used.", dropped, "topic", "reason")
    # Those may fall: what is late is missing no longer.
    missing: dict[str, float] = {topic: counts.missing for topic, counts in accounts.items()}
    yield _gauge("covista_messages_missing", "Messages that were sent, and have not come.", missing, "topic")
    waiting: dict[str, float] = {topic: counts.waiting for topic, counts in accounts.items()}
    yield _gauge("covista_messages_waiting", "Messages whose fate is open: in extraction.", waiting, "topic")


def _swarm(census: Census) -> Iterator[Metric]:
    statuses = {str(status): census.robots.get(status, 0) for status in Status}
    yield _gauge("covista_robots", "Robots by presence.", statuses, "status")
    off = census.clocks_off
    yield _gauge("covista_robots_clock_off", "Robots whose clock is off by more than ten seconds.", off)
    yield _gauge("covista_groups", "Groups.", census.groups)
    without: dict[str, float] = {reason: census.ungrouped.get(reason, 0) for reason in get_args(Reason)}
    yield _gauge("covista_robots_ungrouped", "Robots in no group, by reason.", without, "reason")
    yield _gauge("covista_revision", "Revision of the groups.", census.revision)
    yield _gauge("covista_matrix_revision", "Revision of the similarity matrix.", census.matrix_revision)
    yield _gauge("covista_keyframes_held", "Robots with a keyframe in use.", census.keyframes)
    yield _gauge("covista_pair_records", "Pairs of robots that something is kept of.", census.pairs)


def _workload(load: Workload) -> Iterator[Metric]:
    yield _gauge("covista_pairs_waiting", "Pairs that wait for a survey, by queue.", load.waiting, "queue")
    yield _counter("covista_surveys_started", "Surveys begun, by queue.", load.started, "queue")
    yield _counter(
        "covista_surveys_outdated", "Surveys given up before they began: a newer keyframe came.", load.outdated
    )
    yield _counter("covista_forecasts", "Ordered pairs whose overlap was read anew for a new pose.", load.forecasts)
    yield _gauge(
        "covista_forecasts_waiting", "Robots whose new pose waits for overlaps to be read.", load.forecasts_waiting
    )


def _link(vitals: Vitals) -> Iterator[Metric]:
    mail = vitals.mail
    yield _counter("covista_turned_away", "Messages on no robot's account, by reason.", vitals.turned_away, "reason")
    yield _gauge("covista_mail_robots", "Robots with mail that is not opened yet.", mail.robots)
    yield _gauge("covista_mail_messages", "Messages in mail that is not opened yet.", mail.messages)
    yield _gauge("covista_mail_bytes", "Payload in mail that is not opened yet.", mail.payload_bytes)
    yield _counter(
        "covista_link_refused", "Links on zenoh that may do nothing, by reason.", vitals.link_refused, "reason"
    )
    yield _gauge("covista_link_sessions", "Sessions of zenoh with rovers, routers and others.", vitals.sessions)


def _crew(crew: CrewStatus) -> Iterator[Metric]:
    yield _gauge("covista_workers_capacity", "Jobs that can run at a time.", {crew.kind: crew.capacity}, "kind")
    yield _gauge("covista_workers_warm", "Is compiled code loaded where jobs run?", {crew.kind: crew.warm}, "kind")
    fallback = {crew.kind: crew.fallback is not None}
    yield _gauge("covista_workers_fallback", "Do jobs run here, since they cannot where they should?", fallback, "kind")
    yield _counter("covista_workers_lost", "Workers that died, left, or were ended.", crew.lost)
    yield _counter("covista_jobs_retried", "Jobs done again, since a worker died or did not answer.", crew.retried)
    yield _counter("covista_jobs_overdue", "Jobs that a worker did not return from in time.", crew.overdue)
    yield _counter("covista_jobs_given_up", "Jobs that two workers died of or did not return from.", crew.given_up)
    yield _counter("covista_features_shipped_bytes", "Features that were sent to workers.", crew.shipped_bytes)
    yield _counter("covista_features_shipped_again", "Keyframes whose features were lost there.", crew.shipped_again)


def _sinks(sinks: Mapping[str, SinkStatus]) -> Iterator[Metric]:
    waiting = {name: sink.waiting for name, sink in sinks.items()}
    yield _gauge("covista_news_waiting", "Events and groups that wait to be told, by sink.", waiting, "sink")
    told = {name: sink.told for name, sink in sinks.items()}
    yield _counter("covista_news_told", "Events and groups that were told, by sink.", told, "sink")
    lost = {name: sink.lost for name, sink in sinks.items()}
    yield _counter("covista_news_lost", "Events and groups that could not be told, by sink.", lost, "sink")


def _gauge(name: str, words: str, samples: Samples, *labels: str) -> Metric:
    family = GaugeMetricFamily(name, words, labels=labels)
    _fill(family, samples)
    return family


def _counter(name: str, words: str, samples: Samples, *labels: str) -> Metric:
    family = CounterMetricFamily(name, words, labels=labels)
    _fill(family, samples)
    return family


def _fill(family: GaugeMetricFamily | CounterMetricFamily, samples: Samples) -> None:
    if not isinstance(samples, Mapping):
        family.add_metric((), samples)
        return
    for key, value in samples.items():
        family.add_metric((key,) if isinstance(key, str) else key, value)

"""What Prometheus is told of answers under way, of those that were refused, and of connections that were cut."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from covista_service.api.outgoing import Outgoing
from covista_service.api.stream import Stream


def of_outgoing(outgoing: Outgoing, stream: Stream) -> CollectorRegistry:
    """A registry of what is on its way to clients."""
    registry = CollectorRegistry()
    registry.register(_Answers(outgoing, stream))
    return registry


class _Answers(Collector):
    def __init__(self, outgoing: Outgoing, stream: Stream) -> None:
        self._outgoing = outgoing
        self._stream = stream

    def collect(self) -> Iterator[Metric]:
        held = self._outgoing.held_bytes
        yield GaugeMetricFamily("covista_answers_bytes", "Bytes of large answers under way, each once.", value=held)
        given_up = CounterMetricFamily(
            "covista_clients_given_up", "Answers refused and connections cut, by reason.", labels=["reason"]
        )
        listeners = self._stream.listeners
        yield GaugeMetricFamily("covista_event_listeners", "Clients that listen to events.", value=listeners)
        for reason, count in (self._outgoing.given_up + self._stream.given_up).items():
            given_up.add_metric([reason], count)
        yield given_up

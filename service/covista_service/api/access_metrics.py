"""What Prometheus is told of tokens and of who was not let in; no name of a token, and no address."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from covista_service.access import Gate


def of_access(gate: Gate) -> CollectorRegistry:
    """A registry of one moment."""
    registry = CollectorRegistry()
    registry.register(_Access(gate))
    return registry


class _Access(Collector):
    def __init__(self, gate: Gate) -> None:
        self._gate = gate

    def collect(self) -> Iterator[Metric]:
        refused = CounterMetricFamily(
            "covista_access_refused", "Requests that were not let in, by reason.", labels=["reason"]
        )
        for reason, count in dict(self._gate.refused).items():
            refused.add_metric([reason], count)
        yield refused
        yield GaugeMetricFamily("covista_tokens", "Tokens that are not revoked.", value=self._gate.keyring.live)
        age_s = self._gate.keyring.age_s
        yield GaugeMetricFamily("covista_tokens_age_seconds", "Since the tokens were read.", value=age_s)

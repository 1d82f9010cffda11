"""What /metrics says, parsed as Prometheus would."""

from collections.abc import Iterator

from prometheus_client import Metric
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.samples import Sample

Key = tuple[str, tuple[tuple[str, str], ...]]


def families(text: str) -> dict[str, Metric]:
    """Metrics by name, as Prometheus's text has it: that of a counter ends in _total."""
    return {name_of(family): family for family in text_string_to_metric_families(text)}


def name_of(family: Metric) -> str:
    return f"{family.name}_total" if family.type == "counter" else family.name


def values(text: str) -> dict[Key, float]:
    """Every sample by name and labels."""
    return {key_of(sample): sample.value for family in families(text).values() for sample in family.samples}


def counts(text: str) -> dict[Key, float]:
    """Every sample that must not fall."""
    return {key_of(sample): sample.value for sample in _growing(text)}


def key_of(sample: Sample) -> Key:
    return sample.name, tuple(sorted(sample.labels.items()))


def _growing(text: str) -> Iterator[Sample]:
    for family in families(text).values():
        if family.type in ("counter", "histogram"):
            # When it was created is told as a sample too, and is a gauge.
            yield from (sample for sample in family.samples if not sample.name.endswith("_created"))

"""docs/metrics.md tells of every metric that the station has, and of no other."""

import re
from pathlib import Path

import pytest
from covista_service.config import Settings
from prometheus_client import Metric

from tests.service.api.conftest import Desk
from tests.service.api.expositions import families

PAGE = (Path(__file__).parents[1] / "docs" / "metrics.md").read_text("utf-8")
_ROW = re.compile(r"^\| (`covista_[^|]*) \| (\w+) \|([^|]*)\|", re.MULTILINE)


@pytest.fixture(scope="module")
def exported() -> dict[str, Metric]:
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.settle()
    desk.ask("/healthz")
    told = families(desk.ask("/metrics").text)
    return {name: each for name, each in told.items() if name.startswith("covista_") and not name.endswith("_created")}


def rows() -> dict[str, tuple[str, set[str]]]:
    """Type and labels by metric, as the page has them."""
    return {
        name: (kind, set(re.findall(r"`(\w+)`", labels)))
        for names, kind, labels in _ROW.findall(PAGE)
        for name in re.findall(r"`(\w+)`", names)
    }


def test_every_metric_is_told_of_and_every_metric_told_of_is_there(exported: dict[str, Metric]) -> None:
    assert rows().keys() == exported.keys()


def test_types_and_labels_are_as_told(exported: dict[str, Metric]) -> None:
    for name, family in exported.items():
        kind, told = rows()[name]
        assert kind == family.type, name
        labels = {label for sample in family.samples for label in sample.labels} - {"le"}
        # What has not happened yet has no samples to show its labels.
        assert labels == told or not family.samples, name


def test_alerts_name_metrics_that_are_there(exported: dict[str, Metric]) -> None:
    samples = {f"{name}{ending}" for name in exported for ending in ("", "_bucket", "_sum")}
    alerts = PAGE[PAGE.index("### What to alert on") : PAGE.index("## Logs")]
    named = set(re.findall(r"covista_\w+", alerts))
    assert len(named) > 7
    assert named <= samples


def test_settings_of_the_log_are_told_with_their_defaults() -> None:
    told = re.findall(r"^\| `(log_\w+)` \| `COVISTA_(\w+)` \| `(\w+)` \|", PAGE, re.MULTILINE)
    known = {name: field for name, field in Settings.model_fields.items() if name.startswith("log_")}
    assert {name for name, _, _ in told} == known.keys()
    for name, variable, default in told:
        assert variable == name.upper()
        assert default == str(known[name].default)

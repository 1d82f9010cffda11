"""The dashboard of docker/grafana shows metrics that the station has, and the files around it fit together."""

import json
import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.service.api.conftest import Desk
from tests.service.api.expositions import families
from tests.service.station.scenes import pose

DOCKER = Path(__file__).parents[1] / "docker"
GRAFANA = DOCKER / "grafana"
COLUMNS = 24
# Names that are no metrics: functions, words and labels of the query language.
_NAME = re.compile(r"[a-zA-Z_:][a-zA-Z0-9_:]*")
_LABELS = re.compile(r"\{[^}]*\}|\bby \([^)]*\)|\"[^\"]*\"|\[[^\]]*\]")
_WORDS = {"sum", "rate", "increase", "histogram_quantile", "count", "max", "or", "vector", "by"}
Panel = dict[str, Any]


@pytest.fixture(scope="module")
def dashboard() -> dict[str, Any]:
    return json.loads((GRAFANA / "covista.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def exported() -> dict[str, set[str]]:
    """Names of the samples that a station at work exports, with their labels."""
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.send_pose("r2", pose())
    desk.scene.settle()
    desk.parts.telemetry.surveyed("measured")
    desk.parts.telemetry.fault("loop")
    desk.ask("/api/v1/groups")
    labels: dict[str, set[str]] = {}
    for name, family in families(desk.ask("/metrics").text).items():
        labels.setdefault(name, set())
        for sample in family.samples:
            labels.setdefault(sample.name, set()).update(sample.labels)
    return labels


def panels(dashboard: dict[str, Any]) -> list[Panel]:
    return dashboard["panels"]


def expressions(dashboard: dict[str, Any]) -> Iterator[str]:
    for panel in panels(dashboard):
        yield from (target["expr"] for target in panel.get("targets", []))


def metrics_in(expression: str) -> set[str]:
    return {name for name in _NAME.findall(_LABELS.sub("", expression)) if name not in _WORDS}


def test_every_metric_shown_is_one_that_the_station_exports(
    dashboard: dict[str, Any], exported: dict[str, set[str]]
) -> None:
    shown = {name for expression in expressions(dashboard) for name in metrics_in(expression)}
    assert shown <= exported.keys()
    assert len(shown) > 30


def test_every_metric_of_ours_is_shown_or_stands_for_one_that_is(
    dashboard: dict[str, Any], exported: dict[str, set[str]]
) -> None:
    shown = {re.sub(r"_(bucket|sum|count)$", "", name) for each in expressions(dashboard) for name in metrics_in(each)}
    families = {re.sub(r"_(bucket|sum|count|created)$", "", name) for name in exported if name.startswith("covista_")}
    # `requests` and others have a moment of creation without the ending of their count.
    unseen = {name for name in families - shown if f"{name}_total" not in exported}
    assert unseen == {"covista_workers_warm"}


def test_counts_are_shown_as_rates_and_labels_are_those_that_there_are(
    dashboard: dict[str, Any], exported: dict[str, set[str]]
) -> None:
    for expression in expressions(dashboard):
        for name, labels in re.findall(r"(\w+)\{([^}]*)\}", expression):
            known = exported[name] | {"instance"}
            # What has not happened has no labels yet.
            if exported[name]:
                assert set(re.findall(r"(\w+)\s*(?:=~|!=|!~|=)", labels)) <= known, expression
            if name.endswith(("_total", "_bucket", "_sum", "_count")):
                assert re.search(rf"(rate|increase)\({name}\{{", expression), expression
        assert expression.count("(") == expression.count(")")


def test_legends_name_labels_that_the_expression_keeps(dashboard: dict[str, Any]) -> None:
    for panel in panels(dashboard):
        for target in panel.get("targets", []):
            named = set(re.findall(r"\{\{\s*(\w+)\s*\}\}", target["legendFormat"]))
            kept = {
                name.strip() for group in re.findall(r"by \(([^)]*)\)", target["expr"]) for name in group.split(",")
            }
            assert named <= kept


def test_ids_are_unique_and_so_are_the_queries_of_a_panel(dashboard: dict[str, Any]) -> None:
    ids = [panel["id"] for panel in panels(dashboard)]
    assert len(set(ids)) == len(ids)
    for panel in panels(dashboard):
        references = [target["refId"] for target in panel.get("targets", [])]
        assert len(set(references)) == len(references)
        assert bool(references) is (panel["type"] != "row")


def test_panels_lie_beside_each_other_and_within_the_page(dashboard: dict[str, Any]) -> None:
    places = [panel["gridPos"] for panel in panels(dashboard)]
    for place in places:
        assert 0 <= place["x"] < place["x"] + place["w"] <= COLUMNS
        assert place["y"] >= 0 < place["h"]
    for one, other in combinations(places, 2):
        beside = one["x"] + one["w"] <= other["x"] or other["x"] + other["w"] <= one["x"]
        below = one["y"] + one["h"] <= other["y"] or other["y"] + other["h"] <= one["y"]
        assert beside or below, (one, other)


def test_the_source_of_data_is_chosen_by_who_looks(dashboard: dict[str, Any]) -> None:
    kinds = {variable["name"]: variable["type"] for variable in dashboard["templating"]["list"]}
    assert kinds["datasource"] == "datasource"
    for panel in panels(dashboard):
        for asked in (panel, *panel.get("targets", [])):
            assert asked.get("datasource", {"uid": "${datasource}"})["uid"] == "${datasource}"


@pytest.fixture(scope="module")
def services() -> dict[str, Any]:
    return yaml.safe_load((DOCKER / "compose.yaml").read_text("utf-8"))["services"]


def test_metrics_are_a_profile_so_that_station_and_rovers_need_no_more_images(services: dict[str, Any]) -> None:
    assert {name for name, service in services.items() if "profiles" not in service} == {"station", "r1", "r2", "r3"}
    assert all(services[name]["profiles"] == ["observability"] for name in ("prometheus", "grafana"))


def test_every_port_is_published_on_loopback_unless_told_otherwise(services: dict[str, Any]) -> None:
    ports = [port for service in services.values() for port in service.get("ports", [])]
    assert len(ports) == 5
    assert all(re.fullmatch(r"\$\{COVISTA_\w+_AT:-127\.0\.0\.1:\d+\}:\d+", port) for port in ports)


def test_files_that_containers_are_given_are_there(services: dict[str, Any]) -> None:
    given = [volume.split(":") for service in services.values() for volume in service.get("volumes", [])]
    own = [(DOCKER / source, target, mode) for source, target, *mode in given if source.startswith("./")]
    assert len(own) == 3
    for source, _, mode in own:
        assert source.exists()
        assert mode == ["ro"]


def test_prometheus_asks_the_station_and_grafana_asks_prometheus(services: dict[str, Any]) -> None:
    (job,) = yaml.safe_load((DOCKER / "prometheus.yml").read_text("utf-8"))["scrape_configs"]
    ((target,),) = [each["targets"] for each in job["static_configs"]]
    assert target == f"station:{services['station']['ports'][0].rpartition(':')[2]}"
    sources = yaml.safe_load((GRAFANA / "provisioning/datasources/prometheus.yaml").read_text("utf-8"))["datasources"]
    assert [source["url"] for source in sources] == ["http://prometheus:9090"]
    (provider,) = yaml.safe_load((GRAFANA / "provisioning/dashboards/covista.yaml").read_text("utf-8"))["providers"]
    mounted = [volume.split(":")[1] for volume in services["grafana"]["volumes"]]
    assert f"{provider['options']['path']}/covista.json" in mounted
    assert "/etc/grafana/provisioning" in mounted

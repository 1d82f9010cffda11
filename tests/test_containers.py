"""The files of docker/ agree: variables are listed, settings reach the station, bounds hold for all containers."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from covista_service.settings_command import every

ROOT = Path(__file__).parents[1]
DOCKER = ROOT / "docker"
# Laid over compose.yaml.
OVERLAYS = ("tls", "https", "postgres", "metrics")
PROFILES = {"postgres", "scale", "router", "observability", "load"}
# ${NAME}, ${NAME-default}, ${NAME:-default}
_READ = re.compile(r"\$\{(\w+)(?::?-([^}]*))?\}")
_LISTED = re.compile(r"^#([A-Z][A-Z0-9_]*)=(.*)$", re.MULTILINE)
# Compose reads it by itself.
_COMPOSE_OWN = {"COMPOSE_PROFILES"}


@pytest.fixture(scope="module")
def text() -> str:
    return (DOCKER / "compose.yaml").read_text("utf-8")


@pytest.fixture(scope="module")
def services(text: str) -> dict[str, Any]:
    return yaml.safe_load(text)["services"]


@pytest.fixture(scope="module")
def overlays() -> dict[str, dict[str, Any]]:
    assert {path.name for path in DOCKER.glob("compose.*.yaml")} == {f"compose.{name}.yaml" for name in OVERLAYS}
    texts = {name: (DOCKER / f"compose.{name}.yaml").read_text("utf-8") for name in OVERLAYS}
    return {name: yaml.safe_load(text)["services"] for name, text in texts.items()}


@pytest.fixture(scope="module")
def listed() -> dict[str, str]:
    found = _LISTED.findall((DOCKER / ".env.example").read_text("utf-8"))
    assert len(dict(found)) == len(found)
    return dict(found)


def passed_on(services: dict[str, Any]) -> set[str]:
    """Variables that containers are given as they are set outside, if they are."""
    return {
        name for service in services.values() for name, value in service.get("environment", {}).items() if value is None
    }


def test_every_variable_is_listed_with_what_it_is_when_nobody_sets_it(
    text: str, services: dict[str, Any], listed: dict[str, str]
) -> None:
    read = _READ.findall(text + "".join((DOCKER / f"compose.{name}.yaml").read_text("utf-8") for name in OVERLAYS))
    defaults = dict(read)
    assert all(defaults[name] == default for name, default in read), "one variable, two defaults"
    assert {name: listed.get(name) for name in defaults} == defaults
    assert set(listed) == set(defaults) | passed_on(services) | _COMPOSE_OWN


def test_every_setting_of_the_station_can_be_set_around_it(
    services: dict[str, Any], overlays: dict[str, dict[str, Any]], listed: dict[str, str]
) -> None:
    settings = {each.variable: each for each in every()}
    station = set(services["station"]["environment"])
    assert {name for name in settings if name not in station} == {name for name in settings if "_TLS_" in name}
    station |= set(overlays["tls"]["station"]["environment"]) | set(overlays["https"]["station"]["environment"])
    assert set(settings) <= station
    # REST listens where the network says, and zenoh's certificates lie in one folder.
    fixed = {"COVISTA_API", *(f"COVISTA_ZENOH_TLS_{part}" for part in ("CA", "CERT", "KEY", "ROBOTS"))}
    assert set(settings) - set(listed) == fixed
    for name in passed_on(services):
        assert listed[name] == str(settings[name].default), name


def test_profiles_are_those_that_are_documented(services: dict[str, Any]) -> None:
    assert {profile for service in services.values() for profile in service.get("profiles", [])} == PROFILES
    page = (ROOT / "docs" / "containers.md").read_text("utf-8")
    assert all(f"`{profile}`" in page for profile in PROFILES)
    assert all(f"`{name}`" in page for name in services)


def test_everybody_is_of_the_same_site(services: dict[str, Any]) -> None:
    for name in ("r1", "r2", "r3", "load"):
        assert "--site=${COVISTA_SITE:-default}" in services[name]["command"], name
    assert all("COVISTA_SITE" in passed_on({name: services[name]}) for name in ("station", "router"))


def test_what_is_laid_over_brings_files_that_have_to_be_there(overlays: dict[str, dict[str, Any]]) -> None:
    """In the long form a file that is missing is an error; in the short one it becomes a folder."""
    for name, services in overlays.items():
        for service, added in services.items():
            for mount in added["volumes"]:
                assert (mount["type"], mount["read_only"]) == ("bind", True), (name, service)
    page = (ROOT / "docs" / "containers.md").read_text("utf-8")
    assert all(f"compose.{name}.yaml" in page for name in OVERLAYS)


def test_robots_are_given_their_own_key_alone(overlays: dict[str, dict[str, Any]]) -> None:
    folder = "${COVISTA_CERTS:-./certs}"
    for robot in ("r1", "r2", "r3"):
        sources = {mount["source"] for mount in overlays["tls"][robot]["volumes"]}
        assert sources == {f"{folder}/ca.pem", f"{folder}/{robot}.pem", f"{folder}/{robot}.key"}


def test_the_station_is_there_after_its_database_and_goes_before_it(overlays: dict[str, dict[str, Any]]) -> None:
    station = overlays["postgres"]["station"]
    assert station["depends_on"] == {"postgres": {"condition": "service_healthy"}}
    assert all(service["environment"].get("PGPASSWORD", "") == "" for service in overlays["postgres"].values())
    # An empty one, beside the file: the public image refuses two passwords.
    assert overlays["postgres"]["postgres"]["environment"]["POSTGRES_PASSWORD"] == ""


def test_metrics_are_asked_for_with_a_token_where_there_are_tokens(overlays: dict[str, dict[str, Any]]) -> None:
    mounts = overlays["metrics"]["prometheus"]["volumes"]
    token = next(mount["target"] for mount in mounts if "TOKEN" in mount["source"])
    [plain] = yaml.safe_load((DOCKER / "prometheus.yml").read_text("utf-8"))["scrape_configs"]
    for scheme in ("http", "https"):
        [job] = yaml.safe_load((DOCKER / f"prometheus.{scheme}.yml").read_text("utf-8"))["scrape_configs"]
        assert job["authorization"]["credentials_file"] == token
        assert job.get("scheme", "http") == scheme
        assert job["static_configs"] == plain["static_configs"]


def test_every_container_is_bounded(services: dict[str, Any]) -> None:
    for name, service in services.items():
        assert {"mem_limit", "cpus", "pids_limit", "logging", "restart"} <= set(service), name
        assert service["cap_drop"] == ["ALL"], name
        assert service["security_opt"] == ["no-new-privileges:true"], name
        assert service["logging"]["options"]["max-size"], name


def test_what_is_ours_writes_to_volumes_alone(services: dict[str, Any]) -> None:
    ours = [service for service in services.values() if service["image"].startswith("covista-")]
    assert len(ours) == 8
    assert all(service["read_only"] and service["init"] for service in ours)


def test_rovers_and_operators_share_no_network_but_through_the_station(services: dict[str, Any]) -> None:
    networks = {name: set(service["networks"]) for name, service in services.items()}
    assert all(networks[name] == {"rovers"} for name in ("r1", "r2", "r3", "load"))
    assert networks["router"] == {"rovers", "backbone", "field"}
    assert networks["station"] == {"operators", "inner", "${COVISTA_STATION_NETWORK:-rovers}"}
    assert all(networks[name] == {"inner"} for name in ("postgres", "scheduler", "workers"))
    assert services["station"]["environment"]["COVISTA_API"].startswith("station.")


def test_networks_are_closed_and_ports_are_published_where_it_is_said(text: str, services: dict[str, Any]) -> None:
    networks = yaml.safe_load(text)["networks"]
    assert {name for name, network in networks.items() if (network or {}).get("internal")} == {
        "rovers",
        "inner",
        "backbone",
    }
    assert set(networks) == {"rovers", "inner", "backbone", "operators", "field"}
    published = {name: service["ports"] for name, service in services.items() if "ports" in service}
    assert {name: len(ports) for name, ports in published.items()} == {
        "station": 2,
        "router": 1,
        "prometheus": 1,
        "grafana": 1,
    }
    assert all(":-127.0.0.1:" in port for ports in published.values() for port in ports)


def test_whoever_builds_is_not_made_to_build_a_database() -> None:
    """The classic builder builds every stage that stands before the one that is asked for."""
    assert "postgresql" not in (DOCKER / "Dockerfile").read_text("utf-8")


def test_volumes_have_names() -> None:
    """One that the image declares would be had by router, scheduler and workers too, without a name."""
    assert "VOLUME" not in (DOCKER / "Dockerfile").read_text("utf-8")


def test_the_images_carry_the_version_of_the_project(text: str) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"VERSION: ${{COVISTA_VERSION:-{version}}}" in text
    stages = (DOCKER / "Dockerfile").read_text("utf-8")
    assert stages.count(f"ARG VERSION={version}\n") == 2

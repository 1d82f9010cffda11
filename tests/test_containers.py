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
    read = _READ.findall(text + (DOCKER / "compose.tls.yaml").read_text("utf-8"))
    defaults = dict(read)
    assert all(defaults[name] == default for name, default in read), "one variable, two defaults"
    assert {name: listed.get(name) for name in defaults} == defaults
    assert set(listed) == set(defaults) | passed_on(services) | _COMPOSE_OWN


def test_every_setting_of_the_station_can_be_set_around_it(services: dict[str, Any], listed: dict[str, str]) -> None:
    # REST listens where the network says; certificates come with their files.
    settings = {each.variable: each for each in every() if each.name != "api" and "tls" not in each.name}
    assert set(settings) <= set(services["station"]["environment"])
    for name in passed_on(services):
        assert listed[name] == str(settings[name].default), name


def test_profiles_are_those_that_are_documented(services: dict[str, Any]) -> None:
    assert {profile for service in services.values() for profile in service.get("profiles", [])} == PROFILES
    page = (ROOT / "docs" / "containers.md").read_text("utf-8")
    assert all(f"`{profile}`" in page for profile in PROFILES)
    assert all(f"`{name}`" in page for name in services)


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


def test_the_images_carry_the_version_of_the_project(text: str) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"VERSION: ${{COVISTA_VERSION:-{version}}}" in text
    stages = (DOCKER / "Dockerfile").read_text("utf-8")
    assert stages.count(f"ARG VERSION={version}\n") == 2

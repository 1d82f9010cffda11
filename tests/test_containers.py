"""The files of docker/ agree: variables are listed, settings reach the station, bounds hold for all containers."""

import os
import re
import shutil
import subprocess
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


def run(script: Path, *arguments: str, **environment: str) -> str:
    command = ["bash" if script.name == "base.sh" else "sh", str(script), *arguments]
    settled = {"PATH": os.environ["PATH"], **environment}
    return subprocess.run(command, check=True, capture_output=True, text=True, env=settled, timeout=20).stdout.strip()


def test_the_base_is_looked_up_where_compose_looks_for_it(tmp_path: Path) -> None:
    script = Path(shutil.copy(DOCKER / "base.sh", tmp_path))
    (tmp_path / ".env").write_text("#BASE_IMAGE=nobody/reads:1\nBASE_IMAGE='from/file:1'  # ours\n")
    assert run(script) == "from/file:1"
    assert run(script, BASE_IMAGE="from/around:1") == "from/around:1"


def test_make_takes_the_name_of_the_project_where_compose_finds_it(tmp_path: Path) -> None:
    """Else `docker compose` in the same folder would not see what make started."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "docker").mkdir()

    def name(**environment: str) -> str:
        command = ["make", "--silent", "--eval=say: ; @echo $$COMPOSE_PROJECT_NAME", "say"]
        settled = {"PATH": os.environ["PATH"], **environment}
        done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path, env=settled)
        return done.stdout.strip()

    assert name() == "covista"
    (tmp_path / "docker" / ".env").write_text('COMPOSE_PROJECT_NAME="second"\n')
    assert name() == "second"
    assert name(COMPOSE_PROJECT_NAME="third") == "third"


def test_a_password_is_written_where_the_database_is_asked(tmp_path: Path) -> None:
    """In the form of libpq, and for nobody else's eyes, or libpq ignores it."""
    (tmp_path / "password").write_text("a:b\\c\n")
    places = {"NUMBA_CACHE_DIR": str(tmp_path), "PGPASSFILE": str(tmp_path / "pgpass")}
    run(DOCKER / "start.sh", "true", COVISTA_POSTGRES_PASSWORD_FILE=str(tmp_path / "password"), **places)
    written = tmp_path / "pgpass"
    assert written.read_text() == "*:*:*:*:a\\:b\\\\c\n"
    assert written.stat().st_mode & 0o077 == 0


def test_a_cluster_that_was_begun_is_not_taken_for_one(tmp_path: Path) -> None:
    """The first start is cut short where the database is made; the second makes all of it anew."""
    programs, volume = tmp_path / "bin", tmp_path / "data"
    programs.mkdir()
    volume.mkdir()
    script = {
        "initdb": 'for each; do case "$each" in (--pgdata=*) made=${each#*=};; esac; done\n'
        'mkdir "$made" && cat >"$made/password" && echo 15 >"$made/PG_VERSION"',
        "postgres": 'case "$1" in (--single) [ -e "$READY" ];; (*) echo "runs $PGDATA";; esac',
        "sync": "true",
    }
    for name, body in script.items():
        (programs / name).write_text(f"#!/bin/sh\n{body}\n")
        (programs / name).chmod(0o755)
    settings = {"PATH": f"{programs}:{os.environ['PATH']}", "PGDATA": str(volume), "READY": str(tmp_path / "ready")}
    settings |= {"POSTGRES_USER": "covista", "POSTGRES_DB": "covista", "POSTGRES_PASSWORD": "secret"}
    with pytest.raises(subprocess.CalledProcessError):
        run(DOCKER / "postgres" / "entrypoint.sh", **settings)
    assert not (volume / "cluster").exists()
    (tmp_path / "ready").touch()
    for _ in range(2):
        assert run(DOCKER / "postgres" / "entrypoint.sh", **settings) == f"runs {volume / 'cluster'}"
    assert (volume / "cluster" / "password").read_text() == "secret\n"
    assert [each.name for each in volume.iterdir()] == ["cluster"]

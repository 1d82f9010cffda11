"""What is in the wheel, and what it asks for."""

import re
import tomllib
from email.message import Message
from email.parser import Parser
from importlib.metadata import entry_points
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests import wheel as wheel_of

ROVER_NEEDS = {"eclipse-zenoh", "httpx", "httpx-sse", "numpy", "protobuf", "pydantic", "rich", "typer"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return wheel_of.build(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def contents(wheel: Path) -> list[str]:
    with ZipFile(wheel) as archive:
        return archive.namelist()


@pytest.fixture(scope="module")
def metadata(wheel: Path, contents: list[str]) -> Message:
    (name,) = (name for name in contents if name.endswith(".dist-info/METADATA"))
    with ZipFile(wheel) as archive:
        return Parser().parsestr(archive.read(name).decode())


def test_the_wheel_holds_three_typed_packages_and_nothing_beside(contents: list[str]) -> None:
    packages = {"covista_schemas", "covista_clients", "covista_service"}
    assert {name.split("/")[0] for name in contents if ".dist-info/" not in name} == packages
    assert {f"{package}/py.typed" for package in packages} <= set(contents)


def test_the_wheel_holds_the_wire_for_other_languages(contents: list[str]) -> None:
    assert "covista_schemas/robot.proto" in contents


def test_the_wheel_holds_every_schema_that_the_database_had(contents: list[str]) -> None:
    migrations = "covista_service/store/migrations"
    assert {f"{migrations}/env.py", f"{migrations}/versions/r0001_groups_and_events.py"} <= set(contents)


def test_the_wheel_carries_its_license(contents: list[str]) -> None:
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in contents)


def test_the_base_is_what_a_rover_needs(metadata: Message) -> None:
    required = metadata.get_all("Requires-Dist", [])
    base = {re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in required if "extra ==" not in line}
    assert base == ROVER_NEEDS


def test_the_extras_are_the_documented_ones(metadata: Message) -> None:
    documented = {"vision", "station", "dashboard", "scale", "bench", "fuzz", "dev"}
    assert set(metadata.get_all("Provides-Extra", [])) == documented


def test_the_commands_are_there() -> None:
    scripts = tomllib.loads((wheel_of.ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    installed = entry_points(group="console_scripts")
    assert set(scripts) == {"covista", "covista-station"}
    assert all(callable(installed[name].load()) for name in scripts)

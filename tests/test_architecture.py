"""Who may import whom, where a contract that lists what is forbidden is not enough: lists of what is allowed."""

import sys
import tomllib
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("covista_schemas", "covista_clients", "covista_service")
MATHS = {"numpy", "scipy", "cv2", "numba"}
# Neither a clock, nor a thread, nor a file.
PURE = {
    "abc",
    "bisect",
    "collections",
    "dataclasses",
    "enum",
    "functools",
    "heapq",
    "itertools",
    "math",
    "operator",
    "re",
    "types",
    "typing",
}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def imported_from_outside(graph: grimp.ImportGraph, room: str) -> set[str]:
    modules = {room} | graph.find_descendants(room)
    imported = {name for module in modules for name in graph.find_modules_directly_imported_by(module)}
    return imported - modules - {"__future__"}


@pytest.mark.parametrize("room", ["perception", "grouping"])
def test_the_maths_import_numbers_and_nothing_else(graph: grimp.ImportGraph, room: str) -> None:
    imported = imported_from_outside(graph, f"covista_service.{room}")
    assert imported - {"covista_service.compiled"} <= MATHS | sys.stdlib_module_names


def test_the_core_imports_what_can_neither_wait_nor_ask(graph: grimp.ImportGraph) -> None:
    imported = imported_from_outside(graph, "covista_service.station")
    beside = {
        name for name in imported if not name.startswith(("covista_service.perception", "covista_service.grouping"))
    }
    assert beside <= PURE | {"numpy", "covista_schemas.keys", "covista_schemas.messages", "covista_schemas.reports"}


def test_a_simulated_swarm_fits_on_a_rover(graph: grimp.ImportGraph) -> None:
    imported = imported_from_outside(graph, "covista_clients.simulation")
    beside = {name for name in imported if not name.startswith(PACKAGES)}
    assert beside <= {"numpy", "cv2", "zenoh"} | sys.stdlib_module_names


def test_every_package_is_built_in_floors_that_name_every_room() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    floors = [contract for contract in contracts if contract["type"] == "layers"]
    assert {name for contract in floors for name in contract["containers"]} == set(PACKAGES)
    assert all(contract["exhaustive"] for contract in floors)

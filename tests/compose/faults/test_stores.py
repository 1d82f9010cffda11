"""What stands behind the station dies: the router before it, the database, the cluster."""

import pytest

from tests.compose.faults.conftest import Books
from tests.compose.faults.field import Field
from tests.compose.faults.record import Record, Row

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

# How soon that is meant to be: measured, not asserted, for machines differ.
RESUME_S = 5.0


@pytest.fixture
def behind() -> bool:
    return True


def goes_on(field: Field) -> None:
    """The swarm is at work, but for a moment in which the machine is busy with the fault itself."""
    field.until(field.at_work, 30, "the swarm at work all the same")


def part(field: Field, name: str) -> str:
    return str(field.ask("readyz")["parts"][name]["status"])


def test_a_router_that_is_killed(field: Field, books: Books, record: Record, run: int) -> None:
    """Groups stay as they are; the link's part is degraded; rovers are at work again."""
    used = {robot: report["keyframes"]["used"] for robot, report in field.robots().items()}
    field.crash("router")

    def fresh() -> bool:
        known = field.robots()
        newer = all(known[robot]["keyframes"]["used"] > used[robot] + 1 for robot in used)
        return newer and field.at_work()

    resumed_s = field.until(fresh, 60, "new keyframes of everybody")
    missing = books.close()
    lost = f"{max(missing.values())} keyframes a rover at most"
    record.add(Row("router killed", "groups as they were", {}, resumed_s, lost, RESUME_S))


def test_a_database_that_is_stopped(field: Field, books: Books, record: Record, run: int) -> None:
    """The swarm goes on, /readyz is degraded and says why; started again, what waited is written."""
    field.stop("postgres")
    noticed_s = field.until(lambda: part(field, "store") == "degraded", 30, "degraded")
    revision = field.ask("api/v1/groups")["revision"]
    goes_on(field)
    field.start("postgres")
    back_s = field.until(lambda: part(field, "store") == "ready", 40, "ready")
    history = field.ask("api/v1/groups/history?limit=1000")
    assert revision in {item["revision"] for item in history["items"]}
    assert history["gaps"] == []
    books.close()
    record.add(Row("PostgreSQL stopped", "degraded (store)", {"degraded": noticed_s}, back_s))


@pytest.mark.parametrize(("service", "name", "within_s"), [("workers", "worker", 90), ("scheduler", "scheduler", 120)])
def test_a_part_of_the_cluster_that_is_killed(
    field: Field, books: Books, record: Record, run: int, service: str, name: str, within_s: float
) -> None:
    """Its only worker dies, or its scheduler: threads of the station stand in, until the container is up again."""
    field.crash(service)
    noticed_s = field.until(lambda: part(field, "workers") == "degraded", 30, "degraded")
    goes_on(field)
    back_s = field.until(lambda: part(field, "workers") == "ready", within_s, "ready")
    assert max(books.close().values()) == 0
    record.add(Row(f"Dask {name} killed", "degraded (workers)", {"degraded": noticed_s}, back_s))

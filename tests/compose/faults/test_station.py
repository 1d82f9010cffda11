"""The station dies, or is replaced, while rovers send."""

import pytest

from tests.compose.faults.conftest import Books
from tests.compose.faults.field import ROVERS, Field, docker, relabel
from tests.compose.faults.record import Record, Row

pytestmark = [pytest.mark.compose, pytest.mark.timeout(1800)]

# How soon that is meant to be: measured, not asserted, for machines differ.
RESUME_S = 5.0


def test_a_station_that_is_killed(field: Field, books: Books, record: Record, run: int) -> None:
    """The same groups stand again, under the same labels, as soon as the station answers, and all rovers are at work
    again. What was told until a second before is remembered."""
    before = field.ask("api/v1/groups")
    revision = before["revision"]
    field.crash("station")
    books.station_anew()
    stands_s = field.until(lambda: field.grouped() == set(ROVERS), 60, "groups again")
    after = field.ask("api/v1/groups")
    resumed_s = stands_s + field.until(field.at_work, 60, "the swarm at work")
    assert after["revision"] > revision
    labels = {group["label"] for group in before["groups"]}
    assert labels & {group["label"] for group in after["groups"]}
    books.close()
    lost = "what is sent until it stands; the newest of each rover is sent again"
    record.add(
        Row(
            "station killed",
            "no answer; the groups as they were",
            {"groups stand": stands_s},
            resumed_s,
            lost,
            RESUME_S,
        )
    )


def test_a_station_that_is_upgraded(field: Field, books: Books, record: Record) -> None:
    """The new image starts on the old volume: groups, labels and history are there, and rovers come by themselves."""
    version = "99.0.0"
    relabel("station", "next", version)
    before = field.ask("api/v1/groups")
    stack = field.stack
    upgraded = type(stack)(stack.command, {**stack.environment, "COVISTA_TAG": "next"})
    upgraded.run("up", "--detach", "--no-deps", "station")
    books.station_anew()
    back_s = field.until(field.at_work, 60, "the swarm at work")
    shown = docker(
        "inspect", '--format={{index .Config.Labels "org.opencontainers.image.version"}}', field.container("station")
    )
    assert shown.strip() == version
    history = field.ask("api/v1/groups/history?limit=1000")["items"]
    assert before["revision"] in {item["revision"] for item in history}
    books.close()
    record.add(Row("station upgraded", "no answer; groups and history as they were", {}, back_s, "as if killed"))

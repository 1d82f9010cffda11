"""Every database there was becomes one of today, and nothing in it is lost."""

import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.operations import Operations
from covista_service.store import migrations, tables
from covista_service.store.database import DatabaseError, open_engine
from covista_service.store.migrations import upgrade
from sqlalchemy import Engine, inspect, text


@pytest.fixture
def engine(url: str) -> Iterator[Engine]:
    engine = open_engine(url)
    yield engine
    engine.dispose()


def make_first(engine: Engine) -> None:
    """A database as the first version made it: no number of its schema anywhere."""
    file = Path(migrations.__file__).parent / "versions" / "r0001_groups_and_events.py"
    spec = importlib.util.spec_from_file_location("first", file)
    first = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(first)
    with engine.begin() as connection, Operations.context(MigrationContext.configure(connection)):
        first.upgrade()
        connection.execute(
            text("insert into group_revisions (revision, time_us, report) values (7, 1000, '{}')"),
        )
        connection.execute(text("insert into events (number, time_us, kind, report) values (9, 1000, 'join', '{}')"))


def differences(engine: Engine) -> list[object]:
    with engine.connect() as connection:
        return list(compare_metadata(MigrationContext.configure(connection), tables.metadata))


def test_a_new_database_has_the_tables_that_the_station_knows(engine: Engine) -> None:
    with engine.begin() as connection:
        upgrade(connection)
    assert differences(engine) == []


def test_the_newest_version_is_the_one_that_a_new_database_gets(engine: Engine) -> None:
    with engine.begin() as connection:
        upgrade(connection)
        assert connection.execute(text("select version_num from alembic_version")).scalar_one() == migrations.NEWEST


def test_a_database_of_the_first_version_is_upgraded_and_keeps_what_it_has(engine: Engine) -> None:
    make_first(engine)
    for _ in range(2):
        with engine.begin() as connection:
            upgrade(connection)
    assert differences(engine) == []
    with engine.connect() as connection:
        assert connection.execute(text("select revision from group_revisions")).all() == [(7,)]
        assert connection.execute(text("select number, kind from events")).all() == [(9, "join")]


def test_a_database_of_a_newer_version_is_left_alone(engine: Engine) -> None:
    with engine.begin() as connection:
        upgrade(connection)
        connection.execute(text("update alembic_version set version_num = '9999'"))
    with engine.begin() as connection, pytest.raises(DatabaseError, match=r"newer version .*9999"):
        upgrade(connection)


def test_an_upgrade_that_fails_leaves_nothing_behind(engine: Engine) -> None:
    make_first(engine)
    with engine.begin() as connection:
        # In the way of a table that the upgrade makes last.
        connection.execute(text("create table tokens (id integer primary key)"))
    for _ in range(2):
        with pytest.raises(Exception, match="tokens"), engine.begin() as connection:
            upgrade(connection)
        assert set(inspect(engine).get_table_names()) == {"group_revisions", "events", "tokens"}
    with engine.begin() as connection:
        connection.execute(text("drop table tokens"))
        upgrade(connection)
    assert differences(engine) == []

from collections.abc import Iterator
from pathlib import Path

import pytest
from covista_service.store.archive import Archive
from covista_service.store.database import open_engine
from covista_service.store.migrations import upgrade
from sqlalchemy import Engine

from tests.service.store.server import server  # noqa: F401 - a fixture


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "covista.db"


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """An empty database, of each kind in turn."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'covista.db'}"
    return request.getfixturevalue("server").new_database()


@pytest.fixture
def engine(url: str) -> Iterator[Engine]:
    """The tables of a history, with nothing in them."""
    engine = open_engine(url)
    with engine.begin() as connection:
        upgrade(connection)
    yield engine
    engine.dispose()


@pytest.fixture
def archive(engine: Engine, url: str) -> Iterator[Archive]:
    """Who reads what tests write by the engine."""
    archive = Archive(url)
    yield archive
    archive.close()

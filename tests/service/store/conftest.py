from pathlib import Path

import pytest

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

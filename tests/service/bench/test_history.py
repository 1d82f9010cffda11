"""What the bench of the history asks for is there to be told."""

import random
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

from covista_service.bench import history
from covista_service.store.archive import Archive

HOUR = 1 / 24


def test_every_minute_of_every_robot_and_pair_is_there(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'covista.db'}"
    since = datetime.now(UTC) - timedelta(hours=1)
    history.fill(url, since, HOUR, random.Random(0))
    with closing(Archive(url)) as archive:
        assert [item.revision for item in archive.groups().items] == list(range(1, 61))
        assert len(archive.track("r20").items) == 60
        assert len(archive.pair("r1", "r2").items) == 60


def test_each_kind_of_the_past_is_asked_for() -> None:
    told = history.told_ms(HOUR, random.Random(0), asked_times=2)
    assert set(told) == {"groups_at", "groups_page", "events_page", "pair_page", "track_page"}
    assert all(len(times_ms) == 2 and min(times_ms) > 0 for times_ms in told.values())

"""Scrubbing does not find the same again and again, and takes one reader at most."""

import asyncio
import threading

import pytest
from covista_service.answers.past import Moment
from covista_service.dashboard import recent_moments
from covista_service.dashboard.recent_moments import RecentMoments

from tests.service.dashboard.conftest import PagesDesk, groups, ns
from tests.service.dashboard.test_past_frames import point

REACH_S = 600.0


def counted(desk: PagesDesk, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The moments that the history is asked for."""
    asked: list[int] = []
    read = desk.archive.moment

    def moment(time_ns: int, reach_s: float) -> Moment:
        asked.append(time_ns)
        return read(time_ns, reach_s)

    monkeypatch.setattr(desk.archive, "moment", moment)
    return asked


def test_a_second_is_found_once_and_its_groups_are_exact(
    pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, moments = counted(pages_desk, monkeypatch), RecentMoments()
    pages_desk.write(groups(1, 0, {"g1": ["r1"]}), groups(2, 20.5, {"g2": ["r1"]}), point("r1", 0))
    told = [moments.at(pages_desk.archive, ns(20 + k / 10), REACH_S, ns(1000)) for k in range(10)]
    assert asked == [ns(20)]
    assert [each.groups.revision for each in told if each.groups] == [1] * 5 + [2] * 5
    assert {tuple(each.points) for each in told} == {("r1",)}


def test_no_more_than_a_few_are_kept_and_the_last_ones(pages_desk: PagesDesk, monkeypatch: pytest.MonkeyPatch) -> None:
    asked, moments = counted(pages_desk, monkeypatch), RecentMoments()
    seconds = [*range(recent_moments._KEPT), 0, recent_moments._KEPT, 0, 1]
    for second in seconds:
        moments.at(pages_desk.archive, ns(second), REACH_S, ns(1000))
    # 0 was asked for since, and 1 was not.
    assert asked == [ns(second) for second in (*range(recent_moments._KEPT + 1), 1)]


def test_what_may_not_be_written_yet_is_not_kept(pages_desk: PagesDesk) -> None:
    moments = RecentMoments()
    assert not moments.at(pages_desk.archive, ns(20), REACH_S, ns(21)).points
    pages_desk.write(point("r1", 19))
    assert moments.at(pages_desk.archive, ns(20), REACH_S, ns(22)).points


def test_moments_are_found_one_at_a_time() -> None:
    moments, inside, most = RecentMoments(), 0, 0
    first = threading.Event()

    def work() -> None:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        # Whoever comes beside it would be seen now.
        first.wait(0.05)
        inside -= 1

    async def several() -> None:
        await asyncio.gather(*(moments.run(work) for _ in range(4)))

    asyncio.run(several())
    assert most == 1

"""A station that starts after another was killed knows what that one knew, and uses no number again."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from covista_service.loop import News
from covista_service.station.events import ForgetRobot
from covista_service.station.memory import Memory
from covista_service.store import history as history_module
from covista_service.store import present
from covista_service.store.archive import Archive
from covista_service.store.history import SERVER_START_S, START_S, History
from covista_service.store.numbers import BLOCK, LastNumbers, ahead
from covista_service.store.writer import Writer
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy.exc import OperationalError

from tests.service.deadline import wait_until
from tests.service.link.test_publish import news_of, two_robots
from tests.service.station.memories import plain
from tests.service.station.remembering import remember
from tests.service.station.scenes import NOTHING, S, Scene, measured, pose
from tests.service.store.test_history import ask, kept

FOR_EVER_S = 1e9


def swarm() -> Scene:
    """Five robots, of which some have much in common, and one has a pose alone."""
    scene = Scene()
    for number in range(4):
        scene.send(f"r{number}", pose(0.5 * number))
    scene.send_pose("r4", pose(3.0))
    scene.settle(lambda job: NOTHING if job.first.robot == "r0" else measured(0.3, 0.4))
    return scene


def rounded(told: object) -> object:
    """Poses go through quaternions."""
    if isinstance(told, dict):
        return {key: rounded(each) for key, each in told.items()}
    if isinstance(told, list | tuple):
        return type(told)(rounded(each) for each in told)
    return pytest.approx(told, abs=1e-9) if isinstance(told, float) else told


def same(memory: Memory, other: Memory) -> bool:
    return plain(memory, event=0, revision=0, label=0) == rounded(plain(other, event=0, revision=0, label=0))


def recalled(url: str) -> Memory:
    with kept(url) as history:
        return history.recall(FOR_EVER_S, FOR_EVER_S)


def remembered(history: History, scene: Scene) -> None:
    """Wait until two looks later: what is to be remembered then is written. Afterwards nobody looks."""
    looks: list[None] = []
    one_at_a_time, done = threading.Lock(), threading.Event()

    def look() -> object:
        with one_at_a_time:
            if done.is_set():
                raise TimeoutError
            looks.append(None)
            return scene.snapshot

    history.follow(look)
    wait_until(lambda: len(looks) > 2)
    with one_at_a_time:
        done.set()


def test_what_is_recalled_is_what_stood(url: str) -> None:
    scene = swarm()
    with kept(url) as history:
        history.take(News(scene.snapshot, (), True, ()))
        remembered(history, scene)
        assert same(history.recall(FOR_EVER_S, FOR_EVER_S), remember(scene.snapshot))


def test_a_state_that_cannot_be_stored_ends_neither_retention_nor_the_history(url: str) -> None:
    scene = swarm()
    scene.send("r0", pose(), sequence=2**63)
    with kept(url) as history:
        history.follow(lambda: scene.snapshot)
        wait_until(lambda: "states in a row" in str(history.health().detail))
        history.take(News(scene.snapshot, (), True, ()))
        assert history.flush(10)
        tidied_s = history._writer._size_s
        wait_until(lambda: history._writer._size_s > tidied_s)
        assert history.health().status == "ready"
        scene.receive(ForgetRobot("r0"))
        wait_until(lambda: "states in a row" not in str(history.health().detail))
        remembered(history, scene)
    # It ended in peace: numbers that were not used are given back.
    with kept(url) as history:
        assert history.last.revision == scene.snapshot.groups.revision
        assert same(history.recall(FOR_EVER_S, FOR_EVER_S), remember(scene.snapshot))


def test_what_has_changed_is_recalled_as_it_is_now(url: str) -> None:
    scene = swarm()
    with kept(url) as history:
        remembered(history, scene)
        scene.now_ns += S
        scene.send("r1", pose(0.6))
        scene.settle(lambda job: measured(0.8, 0.9))
        scene.receive(ForgetRobot("r3"))
        scene.send("r5", pose(1.0))
        scene.settle(lambda job: measured(0.1, 0.2))
        remembered(history, scene)
        assert same(
            replace(history.recall(FOR_EVER_S, FOR_EVER_S), groups={}), replace(remember(scene.snapshot), groups={})
        )
        names = {(row[0], row[1]) for row in ask(url, "select robot, sequence from keyframes_now")}
        assert {("r1", 1), ("r5", 0)} <= names


def test_pairs_that_are_too_many_for_one_look_are_written_with_the_next(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(present, "_MOST_PAIRS", 1)
    scene = swarm()
    assert len(scene.snapshot.records) > 3
    with kept(f"sqlite:///{file}") as history:
        history.take(News(scene.snapshot, (), True, ()))
        history.follow(lambda: scene.snapshot)
        wait_until(lambda: same(history.recall(FOR_EVER_S, FOR_EVER_S), remember(scene.snapshot)), "all is written")


def test_keyframes_that_nothing_names_any_more_go(file: Path) -> None:
    scene, steps = swarm(), iter(range(3))

    def look() -> object:
        for _ in zip(range(1), steps, strict=False):
            scene.now_ns += S
            for number in range(4):
                scene.send(f"r{number}", pose(0.5 * number))
            scene.settle(lambda job: measured(0.3, 0.4))
        return scene.snapshot

    with kept(f"sqlite:///{file}") as history:
        history.follow(look)
        question = "select robot, sequence from keyframes_now order by robot, sequence"
        named = [(f"r{number}", 3) for number in range(4)]
        wait_until(lambda: ask(f"sqlite:///{file}", question) == named, "only those in use are left")
        assert same(history.recall(FOR_EVER_S, FOR_EVER_S), replace(remember(scene.snapshot), groups={}))


def test_a_station_that_recalls_stands_where_the_other_stood(url: str) -> None:
    scene = swarm()
    with kept(url) as history:
        history.take(News(scene.snapshot, (), True, ()))
        remembered(history, scene)
    memory = recalled(url)
    again = Scene(memory=memory, now_ns=scene.now_ns)
    assert [(g.label, g.robots) for g in again.snapshot.groups.groups] == [
        (g.label, g.robots) for g in scene.snapshot.groups.groups
    ]
    assert again.snapshot.groups.revision >= scene.snapshot.groups.revision
    for a, b in (("r1", "r2"), ("r2", "r3")):
        assert again.snapshot.pair(a, b).overlap_a == scene.snapshot.pair(a, b).overlap_a


def test_what_is_too_old_is_not_recalled(url: str) -> None:
    scene = swarm()
    with kept(url) as history:
        remembered(history, scene)
        # Scenes play years ago.
        memory = history.recall(600, 600)
        assert (memory.robots, memory.pairs) == ((), ())
        memory = history.recall(FOR_EVER_S, 600)
        assert {robot.id for robot in memory.robots} == set(scene.snapshot.robots)
        assert memory.pairs == ()


@pytest.mark.parametrize(
    "harm",
    [
        "update keyframes_now set camera = 'torn'",
        "update keyframes_now set qx = 0, qy = 0, qz = 0, qw = 0",
        "update robots_now set qx = 0, qy = 0, qz = 0, qw = 0",
        "delete from keyframes_now",
        "update pairs_now set overlap_a = 7",
        "update pairs_now set boot_a = null",
        "update group_revisions set report = '{}'",
        "delete from robots_now",
    ],
)
def test_rows_that_cannot_be_read_are_passed_over(url: str, harm: str, caplog: pytest.LogCaptureFixture) -> None:
    scene = swarm()
    with kept(url) as history:
        history.take(News(scene.snapshot, (), True, ()))
        remembered(history, scene)
    ask(url, f"{harm} returning 1")
    memory = recalled(url)
    assert isinstance(memory, Memory)
    assert memory.revision == scene.snapshot.groups.revision
    Scene(memory=memory, now_ns=scene.now_ns).settle()
    if not harm.startswith("delete from robots"):
        assert "cannot be read" in caplog.text


# Numbers


def test_numbering_goes_on_where_it_ended_in_peace(url: str) -> None:
    with kept(url) as history:
        assert history.last == LastNumbers()
        news = news_of(two_robots())
        history.take(news)
    with kept(url) as history:
        groups = news.snapshot.groups
        assert history.last == LastNumbers(groups.revision, news.events[-1].id, groups.last_label)
        assert groups.revision > 0
        assert groups.last_label > 0


def test_a_database_that_comes_soon_after_the_station_is_waited_for(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    url, news = f"sqlite:///{file}", news_of(two_robots())
    with kept(url) as history:
        history.take(news)
    away = file.parent.rename(file.parent.with_name("away"))

    def come_back() -> None:
        wait_until(lambda: "waits for its database" in caplog.text)
        away.rename(file.parent)

    with ThreadPoolExecutor(1) as pool:
        back = pool.submit(come_back)
        with kept(url, start_s=10.0) as history:
            assert history.last.event == news.events[-1].id
            assert history.health().status == "ready"
        back.result()
    assert "starts without" not in caplog.text


def test_a_database_that_comes_late_is_written_and_a_warning_says_what_stands_twice(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    url, news = f"sqlite:///{file}", news_of(two_robots())
    with kept(url) as history:
        history.take(news)
    away = file.parent.rename(file.parent.with_name("away"))
    with kept(url, start_s=0.05) as history:
        assert history.last == LastNumbers()
        assert "starts without its database" in caplog.text
        away.rename(file.parent)
        history.take(news)
        assert history.flush(10)
    assert caplog.text.count("stand in it twice") == 1
    # Both stand there, and the next station begins above all that may have been used.
    assert ask(url, "select count(*) from events") == [(2 * len(news.events),)]
    with kept(url) as history:
        assert history.last.event > news.events[-1].id


class Clock:
    """Time that passes while somebody sleeps."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


@pytest.mark.parametrize(
    ("where", "longest_s"),
    [("sqlite:////nowhere/covista.db", START_S), ("postgresql+psycopg://covista@127.0.0.1:1/none", SERVER_START_S)],
)
def test_a_server_is_waited_for_longer_than_a_file(
    where: str, longest_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def away(_: Writer) -> LastNumbers:
        raise OperationalError("connect", None, Exception("the database system is starting up"))

    clock = Clock()
    monkeypatch.setattr(history_module, "time", clock)
    monkeypatch.setattr(Writer, "start", away)
    with kept(where, start_s=None):
        assert longest_s - 1 < clock.now_s <= longest_s


def test_a_database_of_a_newer_version_is_not_waited_for(file: Path) -> None:
    url = f"sqlite:///{file}"
    with kept(url):
        pass
    ask(url, "update alembic_version set version_num = 'ffff' returning 1")
    began_s = time.monotonic()
    with kept(url, start_s=30.0) as history:
        assert time.monotonic() - began_s < 10
        assert "newer version" in str(history.health().detail)


def test_numbers_of_a_database_of_the_first_version_are_not_used_again(url: str) -> None:
    news = news_of(two_robots())
    with kept(url) as history:
        history.take(news)
    ask(url, "delete from numbers returning 1")
    with kept(url) as history:
        assert history.last == LastNumbers(news.snapshot.groups.revision, news.events[-1].id, 1)


@given(
    st.builds(LastNumbers, *[st.integers(0, 10**6)] * 3),
    st.lists(st.integers(0, 400), max_size=30),
)
def test_numbers_in_use_are_always_reserved(begun: LastNumbers, steps: list[int]) -> None:
    """A reserve is written with every entry; between two there are fewer numbers than half a block."""
    used, reserved = begun, ahead(begun, begun)
    for step in steps:
        assert used.revision + step < reserved.revision
        used = LastNumbers(used.revision + step, used.event + step, used.label + step)
        reserved = ahead(reserved, used)
        assert all(
            number + block // 2 <= held <= number + block
            for number, held, block in zip(
                (used.revision, used.event, used.label),
                (reserved.revision, reserved.event, reserved.label),
                (BLOCK.revision, BLOCK.event, BLOCK.label),
                strict=True,
            )
        )


VICTIM = """
import sys, time
from tests.service.link.test_publish import news_of, two_robots
from tests.service.store.test_history import FOR_EVER, numbered
from covista_service.store.history import SERVER_START_S, START_S, History

history = History(sys.argv[1], retention=FOR_EVER)
number = history.last.event
news = news_of(two_robots())
while True:
    number += 1
    history.take(next(numbered(news, number)))
    if number % 50 == 0 and history.flush(10):
        print(number, flush=True)
"""


def test_after_a_kill_no_number_comes_again_and_nothing_flushed_is_missing(url: str) -> None:
    used = flushed = 0
    for _ in range(2):
        victim = subprocess.Popen([sys.executable, "-c", VICTIM, url], stdout=subprocess.PIPE, text=True)
        first = int(victim.stdout.readline())
        assert first > used
        flushed = int(victim.stdout.readline())
        os.kill(victim.pid, signal.SIGKILL)
        rest = victim.communicate()[0].split()
        flushed = max(flushed, *map(int, rest), 0) if rest else flushed
        archive = Archive(url)
        stored = [event.id for event in archive.events_after(0, 10**6)]
        archive.close()
        assert len(set(stored)) == len(stored)
        assert flushed in stored
        # What was flushed is whole from the first number of this life on.
        begun = next(k for k in range(len(stored)) if stored[k] > used)
        assert stored[begun:] == list(range(stored[begun], stored[-1] + 1))
        used = stored[-1]

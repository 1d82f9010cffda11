"""The stream of events: nothing missed, nothing twice, and nobody waited for."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from covista_schemas.reports import EventReport, EventsMissed, Problem
from covista_service.api import listening
from covista_service.api.connection import Patience
from covista_service.api.stream import Stream

from tests.service.api.live import Ear, Site, site
from tests.service.deadline import wait_until


@pytest.fixture
def station(tmp_path: Path) -> Iterator[Site]:
    with site(tmp_path) as opened:
        yield opened


def ids(heard: list) -> list[int]:
    return [each.id for each in heard]


def test_events_come_as_they_happen_with_their_ids_and_kinds(station: Site) -> None:
    with Ear(station) as ear:
        assert (ear.status, ear.headers["content-type"]) == (200, "text/event-stream; charset=utf-8")
        assert ear.headers["cache-control"] == "no-store"
        ear.heartbeat()
        station.publish([1, 2])
        first, second = ear.next(), ear.next()
        assert (first.id, first.event, second.id) == (1, "status", 2)
        assert EventReport.model_validate(first.data).text == "r1 is live"


def test_who_gives_no_id_hears_only_what_is_to_come(station: Site) -> None:
    station.publish([1, 2])
    with Ear(station) as ear:
        ear.heartbeat()
        station.publish([3])
        assert ear.next().id == 3


@pytest.mark.parametrize("told_again", [1, 30], ids=["kept in memory", "from the history alone"])
def test_who_comes_back_hears_all_since_then_once_and_in_order(tmp_path: Path, told_again: int) -> None:
    """However much of it is in the history, in memory, or yet to come."""
    with site(tmp_path, Stream(kept=10 if told_again > 1 else 1000)) as station:
        for number in range(1, 40):
            station.publish([number])
        station.stored(39)
        with Ear(station, last=5) as ear:
            assert ids(ear.until(39)) == list(range(6, 40))
            station.publish([40])
            assert ear.next().id == 40
        with Ear(station, query="?last_event_id=38") as ear:
            assert ids(ear.until(40)) == [39, 40]


def test_the_header_goes_before_the_query(station: Site) -> None:
    station.publish(range(1, 6))
    with Ear(station, last=4, query="?last_event_id=1") as ear:
        assert ear.next().id == 5


def test_no_hole_and_no_repeat_while_events_keep_happening(tmp_path: Path) -> None:
    """Twenty listeners come, go, and come back with the id that they heard last, while events never pause."""
    with site(tmp_path, Stream(kept=40)) as station:
        station.publish(range(1, 100))
        station.stored(99)
        stop, published = threading.Event(), [99]

        def keep_publishing() -> None:
            while not stop.wait(0.001):
                published[0] += 1
                station.publish([published[0]])
                # The history is ahead of what memory forgets, as it is in a station that works.
                if published[0] % 20 == 0:
                    station.stored(published[0])

        publisher = threading.Thread(target=keep_publishing)
        publisher.start()
        try:
            for client in range(20):
                heard: list[int] = [client]
                while len(heard) < 130:
                    with Ear(station, last=heard[-1]) as ear:
                        for _ in range(37):
                            one = ear.next()
                            assert one.event == "status", one
                            heard.append(one.id)
                assert heard == list(range(client, client + len(heard)))
        finally:
            stop.set()
            publisher.join()


def test_numbers_that_were_skipped_by_a_restart_are_not_missed(tmp_path: Path) -> None:
    with site(tmp_path) as station:
        station.publish([1, 2, 3])
        station.stored(3)
    with site(tmp_path, Stream(1001)) as station:
        station.publish([1001])
        with Ear(station, last=2) as ear:
            assert ids(ear.until(1001)) == [3, 1001]
        with Ear(station, last=3) as ear:
            assert ear.next().id == 1001


def test_what_is_older_than_what_is_kept_is_named(tmp_path: Path) -> None:
    with site(tmp_path, Stream(kept=3)) as station:
        station.publish(range(21, 31))
        station.stored(30)
        with Ear(station, last=4) as ear:
            reset, *others = ear.until(30)
        assert (reset.event, reset.id) == ("reset", 20)
        missed = EventsMissed.model_validate(reset.data)
        assert (missed.first, missed.last) == (5, 20)
        assert ids(others) == list(range(21, 31))


def test_what_the_history_lost_is_named(tmp_path: Path) -> None:
    with site(tmp_path, Stream(kept=3)) as station:
        station.publish(range(1, 5))
        station.publish(range(5, 11), store=False)
        station.publish(range(11, 15))
        station.publish(range(15, 20), store=False)
        station.stored(14)
        with Ear(station, last=2) as ear:
            heard = ear.until(19)
        assert ids(heard) == [3, 4, 10, 11, 12, 13, 14, 16, 17, 18, 19]
        missed = [EventsMissed.model_validate(each.data) for each in heard if each.event == "reset"]
        assert [(each.first, each.last) for each in missed] == [(5, 10), (15, 16)]


def test_an_id_that_was_never_given_is_told_so(station: Site) -> None:
    station.publish([1, 2])
    with Ear(station, last=77) as ear:
        reset = ear.next()
        assert (reset.event, reset.id) == ("reset", 2)
        station.publish([3])
        assert ear.next().id == 3


def test_a_history_that_cannot_be_read_keeps_nobody_from_listening(tmp_path: Path) -> None:
    with site(tmp_path, Stream(kept=2)) as station:
        station.publish(range(1, 6))
        station.stored(5)
        for file in tmp_path.glob("covista.db*"):
            file.unlink()
        with Ear(station, last=1) as ear:
            reset = ear.next()
            assert (reset.event, reset.data["first"], reset.data["last"]) == ("reset", 2, 3)
            assert ids(ear.until(5)) == [4, 5]


@pytest.mark.parametrize("last", ["x", "-1", "1.5", str(2**63)])
def test_an_id_that_is_none_is_malformed(station: Site, last: str) -> None:
    assert station.get("/events", headers={"last-event-id": last}).status_code == 422
    assert station.get("/events", params={"last_event_id": last}).status_code == 422


def test_silence_is_broken_by_heartbeats_and_nobody_is_cut_off_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listening, "HEARTBEAT_S", 0.05)
    with site(tmp_path, patience=Patience(look_s=0.1)) as station, Ear(station) as ear:
        for _ in range(12):
            ear.heartbeat()
        station.publish([1])
        assert ear.next().id == 1
        assert not station.parts.outgoing.given_up


def test_who_reads_slowly_is_cut_off_with_a_last_word_and_comes_back_without_loss(tmp_path: Path) -> None:
    with site(tmp_path, Stream(buffer=20, kept=100_000)) as station, Ear(station, receive_bytes=4096) as ear:
        ear.heartbeat()
        number = 0
        while not station.parts.stream.given_up["behind"]:
            station.publish(range(number + 1, number + 101), store=False)
            number += 100
        heard = ear.rest()
        assert heard[-1].event == "cut"
        assert Problem.model_validate(heard[-1].data).title == "Reads too slowly"
        assert heard[-1].id is None
        got = ids(heard[:-1])
        assert got == list(range(1, len(got) + 1))
        assert len(got) < number
        assert station.parts.stream.given_up == {"behind": 1}
        with Ear(station, last=got[-1]) as again:
            assert ids(again.until(number)) == list(range(got[-1] + 1, number + 1))


def test_who_does_not_read_at_all_keeps_nobody_waiting_and_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("covista_service.api.stream._FAREWELL_S", 0.1)
    with site(tmp_path, Stream(buffer=20)) as station, Ear(station, receive_bytes=4096) as deaf, Ear(station) as ear:
        deaf.heartbeat()
        ear.heartbeat()
        number = 0
        while not station.parts.stream.given_up["behind"]:
            station.publish(range(number + 1, number + 101), store=False)
            assert ids(ear.until(number + 100)) == list(range(number + 1, number + 101))
            number += 100
        wait_until(lambda: station.parts.stream.listeners == 1, "the deaf one is gone")
        station.publish([number + 1])
        assert ear.next().id == number + 1


def test_a_burst_is_not_taken_for_slowness(tmp_path: Path) -> None:
    with site(tmp_path, Stream(buffer=20)) as station, Ear(station) as ear:
        ear.heartbeat()
        station.publish(range(1, 1001), store=False)
        assert ids(ear.until(1000)) == list(range(1, 1001))


def test_one_too_many_hears_so_and_takes_nobody_s_place(tmp_path: Path) -> None:
    with site(tmp_path, Stream(listeners=2)) as station, ExitStack() as stack:
        for _ in range(2):
            stack.enter_context(Ear(station)).heartbeat()
        refused = station.get("/events")
        assert (refused.status_code, refused.headers["retry-after"]) == (503, "10")
        assert Problem.model_validate_json(refused.content).title == "Too many listen already"
        assert station.parts.stream.given_up == {"crowd": 1}
        assert 'covista_clients_given_up_total{reason="crowd"} 1.0' in httpx.get(f"{station.url}/metrics").text
        stack.close()
        wait_until(lambda: station.parts.stream.listeners == 0)
        with Ear(station) as ear:
            ear.heartbeat()


def test_listeners_do_not_count_as_a_crowd(tmp_path: Path) -> None:
    with site(tmp_path, patience=Patience(connections=3)) as station, ExitStack() as stack:
        for _ in range(20):
            stack.enter_context(Ear(station)).heartbeat()
        assert station.get("/groups").status_code == 200


def test_who_has_gone_is_forgotten(station: Site) -> None:
    with Ear(station) as ear:
        ear.heartbeat()
        assert station.parts.stream.listeners == 1
    wait_until(lambda: station.parts.stream.listeners == 0)


def test_nobody_listens_for_ever_without_asking_anew(tmp_path: Path) -> None:
    with site(tmp_path, Stream(longest_s=0.2)) as station, Ear(station) as ear:
        (cut,) = ear.rest()
        assert (cut.event, cut.data["title"]) == ("cut", "Listened for long enough")
        # Who has heard of nothing yet knows all the same where to come back to.
        assert ear.at == station.parts.stream.last


def test_all_streams_end_with_a_last_word_when_the_station_stops(station: Site) -> None:
    with ExitStack() as stack:
        ears = [stack.enter_context(Ear(station)) for _ in range(5)]
        for ear in ears:
            ear.heartbeat()
        station.inside(station.parts.stream.close)
        for ear in ears:
            (cut,) = ear.rest()
            assert (cut.event, cut.data["title"]) == ("cut", "The station is stopping")
        assert station.get("/events").status_code == 503


def test_head_tells_of_the_stream_and_does_not_begin_it(station: Site) -> None:
    response = station.ask("HEAD", "/events")
    assert (response.status_code, response.headers["content-type"]) == (200, "text/event-stream; charset=utf-8")
    wait_until(lambda: station.parts.stream.listeners == 0)


def test_an_event_is_put_into_words_once_however_many_listen(station: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[int] = []
    write = EventReport.model_dump_json
    monkeypatch.setattr(
        EventReport, "model_dump_json", lambda self, **how: written.append(self.id) or write(self, **how)
    )
    with ExitStack() as stack:
        ears = [stack.enter_context(Ear(station)) for _ in range(10)]
        for ear in ears:
            ear.heartbeat()
        station.publish([1], store=False)
        assert [ear.next().id for ear in ears] == [1] * 10
    assert written == [1]

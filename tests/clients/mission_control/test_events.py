import logging
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from covista_clients import MissionControl
from covista_clients.mission_control import events as events_module
from covista_clients.mission_control.connection import ATTEMPTS
from covista_schemas.errors import ApiError, ForbiddenError, UnauthorizedError
from covista_schemas.reports import EventReport, Problem

from tests.clients.event_server import DEADLINE_S, Teller, cut, event, telling
from tests.clients.ground import free_endpoint
from tests.clients.sample import EVENTS


@pytest.fixture(autouse=True)
def _in_haste(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events_module, "_FIRST_PAUSE_S", 0.02)


def say(*parts: bytes, stay: bool = False) -> object:
    def tell(teller: Teller) -> None:
        teller.begin()
        teller.say(*parts)
        if stay:
            teller.stay()

    return tell


def wire(*numbers: int) -> list[bytes]:
    return [event(EVENTS[number - 1]) for number in numbers]


def take(events: Iterator[EventReport], count: int) -> list[int]:
    return [next(events).id for _ in range(count)]


def test_events_come_as_they_happen() -> None:
    with telling(say(b": hello\n\n", *wire(1, 2), b": heartbeat\n\n", *wire(3), stay=True)) as server:
        with MissionControl(server.url) as control, control.events() as events:
            assert [next(events) for _ in range(3)] == EVENTS[:3]
        assert server.asked == [None]


def test_a_connection_that_ends_is_replaced_where_it_ended() -> None:
    with telling(say(*wire(1, 2)), say(), say(*wire(3)), say(*wire(4, 5), stay=True)) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(), 5) == [1, 2, 3, 4, 5]
        assert server.asked == [None, "2", "2", "3"]


def test_half_an_event_is_none() -> None:
    (whole,) = wire(2)
    with telling(say(*wire(1), whole[:-20]), say(whole, stay=True)) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(), 2) == [1, 2]
        assert server.asked == [None, "1"]


@pytest.mark.parametrize("since", [17, "17"])
def test_one_may_begin_after_a_known_event(since: int | str) -> None:
    with telling(say(*wire(1), stay=True)) as server:
        with MissionControl(server.url) as control:
            events = control.events(since)
            assert events.last_event_id == "17"
            take(events, 1)
            assert events.last_event_id == "1"
        assert server.asked == ["17"]


def test_who_is_cut_off_comes_again(caplog: pytest.LogCaptureFixture) -> None:
    slow = Problem(title="Too slow", status=503, detail="256 events wait")
    with telling(say(*wire(1), cut(slow)), say(*wire(2), stay=True)) as server:
        with MissionControl(server.url) as control, caplog.at_level(logging.INFO):
            assert take(control.events(), 2) == [1, 2]
        assert server.asked == [None, "1"]
    assert "ends the stream of events: Too slow: 256 events wait" in caplog.text
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_what_is_missing_is_said(caplog: pytest.LogCaptureFixture) -> None:
    reset = b'event: reset\ndata: {"first": 2, "last": 3, "reason": "not kept"}\nid: 3\n\n'
    with telling(say(reset), say(*wire(4), stay=True)) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(1), 1) == [4]
        assert server.asked == ["1", "3"]
    assert "events are missing: 2 to 3: not kept" in caplog.text


def test_what_later_versions_tell_is_passed_over() -> None:
    newer = b'id: 2\nevent: eclipse\ndata: {"id": 2, "event": "eclipse"}\n\nid: 2\n\n'
    with telling(say(*wire(1), newer), say(*wire(3), stay=True)) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(), 2) == [1, 3]
        assert server.asked == [None, "2"]


def test_a_station_that_is_away_for_a_while_is_come_back_to(caplog: pytest.LogCaptureFixture) -> None:
    def away(teller: Teller) -> None:
        teller.refuse(503)

    script = [say(*wire(1)), *[away] * (ATTEMPTS + 3), say(*wire(2), stay=True)]
    with telling(*script) as server, caplog.at_level(logging.WARNING):
        with MissionControl(server.url) as control:
            assert take(control.events(), 2) == [1, 2]
        assert len(server.asked) == len(script)
    assert len(caplog.records) <= 2


def test_silence_is_the_end_of_a_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events_module, "QUIET_S", 0.2)
    with telling(say(*wire(1), stay=True), say(*wire(2), stay=True)) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(), 2) == [1, 2]
        assert server.asked == [None, "1"]


def test_heartbeats_are_signs_of_life(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events_module, "QUIET_S", 0.6)

    def tell(teller: Teller) -> None:
        teller.begin()
        for _ in range(10):
            teller.say(b": heartbeat\n\n")
            teller.server.ending.wait(0.1)
        teller.say(*wire(1))
        teller.stay()

    with telling(tell) as server:
        with MissionControl(server.url) as control:
            assert take(control.events(), 1) == [1]
        assert server.asked == [None]


@pytest.mark.parametrize("secured", [False, True])
@pytest.mark.parametrize("closes", ["events", "control"])
def test_closing_ends_whoever_waits(closes: str, secured: bool, certificate: tuple[Path, Path]) -> None:
    with telling(say(*wire(1), stay=True), certificate=certificate if secured else None) as server:
        url = server.url.replace("http:", "https:") if secured else server.url
        end_of_waiting(MissionControl(url, verify=certificate[0]), closes)
        assert len(server.asked) == 1


def end_of_waiting(control: MissionControl, closes: str) -> None:
    with control:
        events = control.events()
        heard: list[int] = []
        waiting = threading.Event()

        def listen() -> None:
            for report in events:
                heard.append(report.id)
                waiting.set()

        thread = threading.Thread(target=listen)
        thread.start()
        assert waiting.wait(DEADLINE_S)
        began_s = time.monotonic()
        (events if closes == "events" else control).close()
        thread.join(DEADLINE_S)
        assert time.monotonic() - began_s < 1
        assert heard == [1]
        assert list(events) == []


def test_closing_ends_the_wait_for_a_station_that_is_away() -> None:
    def away(teller: Teller) -> None:
        teller.refuse(429, {"Retry-After": "3600"})

    with telling(say(*wire(1)), away) as server, MissionControl(server.url) as control:
        events = control.events()
        take(events, 1)
        closing = threading.Thread(target=lambda: (server.wait_for_connections(2), events.close()))
        closing.start()
        assert list(events) == []
        closing.join()
        assert len(server.asked) == 2


def test_a_station_that_was_never_there_is_an_error() -> None:
    url = free_endpoint().replace("tcp/", "http://")
    with MissionControl(url) as control, pytest.raises(ApiError, match="no answer"):
        next(control.events())


@pytest.mark.parametrize("status", [401, 403, 404, 422])
def test_a_refusal_is_an_error_at_once(status: int) -> None:
    with telling(lambda teller: teller.refuse(status)) as server:
        with MissionControl(server.url) as control, pytest.raises(ApiError) as caught:
            next(control.events())
        assert len(server.asked) == 1
    assert caught.value.status == status
    assert isinstance(caught.value, ForbiddenError) == (status == 403)


def test_a_refusal_later_on_is_an_error_too() -> None:
    with telling(say(*wire(1)), lambda teller: teller.refuse(401)) as server, MissionControl(server.url) as control:
        events = control.events()
        take(events, 1)
        with pytest.raises(UnauthorizedError):
            next(events)


def page(teller: Teller) -> None:
    teller.begin("text/html")
    teller.say(b"<html>")


@pytest.mark.parametrize("tell", [page, say(b"event: join\ndata: {}\n\n"), say(b"event: join\ndata: x\n\n")])
def test_what_is_no_station_is_an_error(tell: object) -> None:
    with telling(tell) as server, MissionControl(server.url) as control, pytest.raises(ApiError, match="as a station"):
        next(control.events())


def test_who_loses_the_stream_before_the_first_event_comes_back_with_where_it_began() -> None:
    with (
        telling(say(b": \n\nid: 1\n\n"), say(*wire(2))) as server,
        MissionControl(server.url) as control,
    ):
        events = control.events()
        take(events, 1)
        assert events.last_event_id == "2"
    assert server.asked[:2] == [None, "1"]

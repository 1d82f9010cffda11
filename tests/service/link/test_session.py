import queue
import time
from collections.abc import Callable

import pytest
import zenoh
from covista_schemas import zenoh_config
from covista_schemas.errors import LinkError
from covista_service.link import admission, mailbox, session, switchboard
from covista_service.link.session import open_session
from covista_service.link.switchboard import Switchboard, opening

from tests.service.deadline import free_endpoint, wait_until
from tests.service.link.conftest import Air


def test_a_taken_port_is_one_line_with_the_port_and_the_flag(air: Air) -> None:
    with pytest.raises(LinkError) as caught:
        open_session([air.endpoint], [])
    line = str(caught.value)
    assert air.endpoint in line
    assert "--link (COVISTA_LINK)" in line
    assert "in use" in line
    assert "\n" not in line
    assert ".rs" not in line


def test_an_address_that_is_not_ours_is_named() -> None:
    with pytest.raises(LinkError, match=r"cannot listen on tcp/192\.0\.2\.1:7447"):
        open_session(["tcp/192.0.2.1:7447"], [])


def test_a_router_that_is_not_there_does_not_keep_the_station_from_starting() -> None:
    open_session([free_endpoint()], [free_endpoint()]).close()


def test_as_many_links_there_may_be_as_robots_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    assert max(admission.MAX_ROBOTS, mailbox.MAX_ROBOTS) < session.MAX_SESSIONS
    monkeypatch.setattr(session, "MAX_SESSIONS", 1)
    endpoint = free_endpoint()
    with (
        open_session([endpoint], []),
        open_session([], [endpoint]),
        pytest.raises(LinkError, match="no router answers"),
    ):
        open_session([], [endpoint])


def test_who_only_joins_needs_a_router_now() -> None:
    with pytest.raises(LinkError, match="no router answers"):
        open_session([], [free_endpoint()])


def test_a_switchboard_waits_for_a_router_and_plugs_in_when_there_is_one() -> None:
    endpoint, heard = free_endpoint(), queue.SimpleQueue[str]()

    def join(opened: zenoh.Session) -> Callable[[], object]:
        return opened.declare_subscriber("waits/for", lambda sample: heard.put(sample.payload.to_string())).undeclare

    board = Switchboard(opening([], [endpoint], "default", None), waits=True, every_s=0.02)
    try:
        unplug = board.plug(join)
        wait_until(lambda: board.problem == "cannot open: no router answers", "it says so")
        with open_session([endpoint], []) as router:
            wait_until(lambda: board.joined and board.problem is None, "they are joined")
            publisher = router.declare_publisher("waits/for")
            wait_until(lambda: publisher.matching_status.matching, "it listens")
            publisher.put("here")
            assert heard.get(timeout=5) == "here"
        unplug()
    finally:
        board.close()


def test_who_has_taken_the_station_s_id_at_a_router_keeps_it_out_for_seconds_alone(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    endpoint, ids = free_endpoint(), queue.SimpleQueue[str]()

    def join(opened: zenoh.Session) -> Callable[[], object]:
        ids.put(str(opened.zid()))
        return lambda: None

    # So that the thief is the first whom the router sees when it comes again.
    monkeypatch.setattr(zenoh_config, "RETRY", {"period_init_ms": 5000, "period_max_ms": 5000})
    monkeypatch.setattr(switchboard, "ALONE_S", 4.0)
    router = open_session([endpoint], [])
    board = Switchboard(opening([], [endpoint], "default", None), waits=True, every_s=0.02)
    try:
        board.plug(join)
        wait_until(lambda: board.joined, "they are joined")
        taken = ids.get(timeout=5)
        router.close()
        wait_until(lambda: not board.joined, "the router is missed")
        missed_s = time.monotonic()
        # It tries at once, and then seconds later.
        wait_until(lambda: not board.joined and time.monotonic() - missed_s > 1.0, "it has tried")
        router = open_session([endpoint], [])
        thief = zenoh_config.config("client", connect=[endpoint])
        thief.insert_json5("id", f'"{taken}"')
        with zenoh.open(thief):
            wait_until(lambda: board.joined, "the station is joined again")
            assert ids.get(timeout=5) != taken
        assert "zenoh opens anew under another id" in caplog.text
    finally:
        board.close()
        router.close()

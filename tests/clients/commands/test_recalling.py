import signal
import subprocess
import sys
from urllib.parse import parse_qs, urlsplit

import pytest
from covista_schemas.reports import EventReport, EventsHistory

from tests.clients import sample
from tests.clients.commands.conftest import Run, _Station
from tests.clients.event_server import DEADLINE_S, Teller, event, telling


def asked(api: _Station) -> list[dict[str, list[str]]]:
    return [parse_qs(urlsplit(path).query) for path, _ in api.asked]


def test_a_span_and_a_limit_are_passed_on(run: Run, api: _Station) -> None:
    span = ["--from", "2026-05-04T03:02:01", "--to", "2026-05-04T05:02:01+02:00", "--limit", 7]
    assert (
        run("history", "events", *span, "--kind", "join", "--kind", "leave", "--robot", "r1", "--url", api.url)[0] == 0
    )
    told = ["2026-05-04T03:02:01+00:00"]
    assert asked(api) == [{"from": told, "to": told, "limit": ["7"], "kind": ["join", "leave"], "robot": ["r1"]}]


def test_a_time_that_is_none_is_told_with_how_to_do_it_right(run: Run) -> None:
    code, _, err = run("history", "groups", "--from", "yesterday")
    assert code == 2
    assert "2026-05-04T03:02:01Z" in err


def test_many_entries_take_many_pages(run: Run, api: _Station, monkeypatch: pytest.MonkeyPatch) -> None:
    page = sample.EVENTS_HISTORY.model_copy(update={"items": sample.EVENTS * 20, "next": "more"})
    monkeypatch.setitem(sample.ANSWERS, "/api/v1/events/history", page)
    _, out, _ = run("history", "events", "--limit", 200, "--url", api.url, "--format", "json")
    whole = EventsHistory.model_validate_json(out)
    assert (len(whole.items), whole.gaps, whole.next) == (200, [sample.GAP], "more")
    assert asked(api) == [{"limit": ["100"]}, {"limit": ["100"], "cursor": ["more"]}]
    assert "--cursor more" in run("history", "events", "--url", api.url)[1]
    assert "cursor" not in asked(api)[-1]
    run("history", "events", "--url", api.url, "--cursor", "more")
    assert asked(api)[-1]["cursor"] == ["more"]


def test_events_of_the_past_are_those_after_the_one_named(run: Run, api: _Station) -> None:
    code, out, err = run("events", "--since", 3, "--url", api.url)
    assert (code, err) == (0, "")
    assert [line.split()[2] for line in out.splitlines()] == ["4", "5"]
    _, out, _ = run("events", "--format", "json", "--url", api.url)
    assert [EventReport.model_validate_json(line) for line in out.splitlines()] == sample.EVENTS
    assert [sorted(query) for query in asked(api)] == [["limit"], ["from", "limit"]]


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_events_are_followed_until_told_to_stop(end: signal.Signals) -> None:
    def tell(teller: Teller) -> None:
        teller.begin()
        teller.say(*map(event, sample.EVENTS[2:4]))
        teller.stay()

    with telling(tell) as server:
        command = [sys.executable, "-m", "covista_clients", "events", "--follow", "--since", "2", "--url", server.url]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            told = [process.stdout.readline() for _ in range(2)]
            process.send_signal(end)
            out, err = process.communicate(timeout=DEADLINE_S)
        finally:
            process.kill()
            process.communicate()
        assert server.asked == ["2"]
    assert told[0] == "1970-01-01 00:00:03       3  join      r1 joined g1 [3] (by ada)\n"
    assert told[1].endswith("r1 joined g1 [4]\n")
    assert (process.returncode, out, err) == (0, "", "")

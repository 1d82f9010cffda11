from typing import Literal

import pytest
from covista_schemas.reports import GroupsReport, Health, PartHealth, RobotsReport, Score

from tests.clients import sample
from tests.clients.commands.conftest import Run, _Station
from tests.clients.event_server import telling
from tests.clients.ground import free_endpoint

COMMANDS = {
    "robots": (sample.ROBOTS, ["r1", "live", "g1", "1.00 2.00 3.00", "length [bold]2[/bold]"]),
    "pairs": (sample.PAIRS, ["r1", "r2", "0.25", "-", "image", "77", "1.5"]),
    "similarity": (sample.SIMILARITY, ["revision 4", "r2", "0.50"]),
    "settings": (sample.GROUPS.settings, ["alpha", "0.5", "hysteresis.gain", "0.05"]),
    "history groups": (sample.GROUPS_HISTORY, ["1970-01-01 01:00:00", "7", "g1: r1 r2 | r3 (no_pose)"]),
    "history events": (
        sample.EVENTS_HISTORY,
        ["00:00:03", "join", "r1 joined g1 [3]", "ada", "4 entries missing from"],
    ),
    "history pair r1 r2": (sample.PAIR_HISTORY, ["r1 seen by r2", "0.50", "-", "predicted"]),
    "history track r1": (sample.TRACK, ["1970-01-01 00:00:07", "1.00 2.00 3.00", "0.00 0.00 0.00 1.00"]),
    "groups": (sample.GROUPS, ["g1", "r1 r2", "r3 (no_pose)", "revision 7", "fiedler", "1: 0.500"]),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_table_for_people(run: Run, api: _Station, command: str) -> None:
    code, out, err = run(*command.split(), "--url", api.url)
    assert (code, err) == (0, "")
    for word in COMMANDS[command][1]:
        assert word in out


@pytest.mark.parametrize("command", COMMANDS)
def test_json_alone_for_programs(run: Run, api: _Station, command: str) -> None:
    report = COMMANDS[command][0]
    code, out, err = run(*command.split(), "--url", api.url, "--format", "json")
    assert (code, err) == (0, "")
    assert type(report).model_validate_json(out) == report


def test_address_and_token_may_come_from_the_environment(
    run: Run, api: _Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COVISTA_URL", api.url)
    monkeypatch.setenv("COVISTA_TOKEN", "secret")
    assert run("pairs", "--robot", "r1", "--min-overlap", "0.5")[0] == 0
    assert api.asked == [("/api/v1/pairs?robot=r1&min_overlap=0.5", "Bearer secret")]


def test_what_goes_wrong_is_one_line(run: Run) -> None:
    url = free_endpoint().replace("tcp/", "http://")
    code, out, err = run("groups", "--url", url)
    assert (code, out) == (1, "")
    assert err.startswith(f"covista: no answer from {url}")
    assert len(err.splitlines()) == 1


def test_a_wrong_option_is_told_with_how_to_do_it_right(run: Run) -> None:
    code, _, err = run("groups", "--format", "xml")
    assert code == 2
    assert "table" in err


def test_without_a_command_there_is_help(run: Run) -> None:
    _, out, err = run()
    for command in (*COMMANDS, "watch", "send", "swarm", "render", "events", "preview", "forget"):
        assert command.split()[0] in out + err


def test_an_empty_station_has_tables_too(run: Run, api: _Station, monkeypatch: pytest.MonkeyPatch) -> None:
    empty = sample.GROUPS.model_copy(update={"groups": [], "ungrouped": [], "scores": []})
    assert isinstance(empty, GroupsReport)
    monkeypatch.setitem(sample.ANSWERS, "/api/v1/groups", empty)
    code, out, _ = run("groups", "--url", api.url)
    assert code == 0
    assert "revision 7" in out


def test_of_many_numbers_of_groups_the_best_are_shown_and_a_note_if_there_is_one(
    run: Run, api: _Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    scores = [Score(groups=m, score=1 / (1 + abs(m - 8))) for m in range(1, 21)]
    told = {"scores": scores, "note": "3 robots cannot form 4 groups", "waiting": ["r2"]}
    report = sample.GROUPS.model_copy(update=told)
    assert isinstance(report, GroupsReport)
    monkeypatch.setitem(sample.ANSWERS, "/api/v1/groups", report)
    _, out, _ = run("groups", "--url", api.url)
    said = " ".join(out.split())
    assert "6: 0.333, 7: 0.500, 8: 1.000, 9: 0.500, 10: 0.333, and 15 lower" in said
    assert "another grouping is proposed, and shown if it lasts, for r2" in said
    assert "note: 3 robots cannot form 4 groups" in said


def test_forgetting_says_so(run: Run, api: _Station) -> None:
    assert run("forget", "r1", "--url", api.url) == (0, "r1 is forgotten\n", "")
    assert api.told == [("DELETE", "/api/v1/robots/r1", None)]
    assert run("forget", "r9", "--url", api.url)[0] == 1


def test_a_token_that_does_not_reach_so_far_is_told_what_it_lacks(run: Run) -> None:
    with telling(lambda teller: teller.refuse(403, {"WWW-Authenticate": "Bearer"})) as server:
        code, out, err = run("groups", "--url", server.url, "--token", "secret")
    assert (code, out) == (1, "")
    assert err == "covista: GET /api/v1/groups needs a token with scope read\n"


def test_the_help_warns_of_tokens_that_everybody_can_read(run: Run) -> None:
    said = " ".join(run("groups", "--help")[1].split())
    assert "COVISTA_TOKEN" in said
    assert "list of processes" in said


def test_a_file_of_authorities_that_is_not_there_is_one_line(run: Run) -> None:
    code, _, err = run("groups", "--url", "https://127.0.0.1:1", "--ca", "absent.pem")
    assert code == 1
    assert err.startswith("covista: absent.pem cannot be used")


@pytest.mark.parametrize("status", ["starting", "ready"])
def test_of_a_station_that_is_starting_it_is_told_that_it_knows_nobody_yet(
    run: Run, api: _Station, monkeypatch: pytest.MonkeyPatch, status: Literal["starting", "ready"]
) -> None:
    health = Health(status=status, parts={"loop": PartHealth(status=status, detail="loading compiled code")})
    monkeypatch.setitem(sample.ANSWERS, "/api/v1/robots", RobotsReport(robots=[]))
    monkeypatch.setitem(sample.ANSWERS, "/readyz", health)
    code, _, err = run("robots", "--url", api.url)
    assert code == 0
    assert err == ("The station is still starting (loop: loading compiled code).\n" if status == "starting" else "")

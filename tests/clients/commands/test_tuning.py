import json

import pytest
from covista_clients.commands.tuning import parse_changes
from covista_schemas.errors import CovistaError
from covista_schemas.reports import GroupsReport, LiveSettings

from tests.clients import sample
from tests.clients.commands.conftest import Run, _Station


def test_a_preview_stands_beside_the_groups_in_force(run: Run, api: _Station) -> None:
    code, out, err = run("preview", "--alpha", 0.7, "--groups", 2, "--criterion", "gain", "--url", api.url)
    assert (code, err) == (0, "")
    assert [line.split() for line in out.splitlines()] == [
        ["robot", "in", "force", "preview"],
        ["r1", "g1", "g1"],
        ["r2", "g1", "g2"],
        ["1", "groups", "by", "fiedler,", "2", "by", "gain"],
    ]
    assert api.told == [("POST", "/api/v1/groups/preview", {"alpha": 0.7, "groups": 2, "criterion": "gain"})]


def test_a_preview_for_programs_is_its_report(run: Run, api: _Station) -> None:
    _, out, _ = run(
        "preview", "--groups", '{"min": 1, "max": 2}', "--sigma", "std", "--url", api.url, "--format", "json"
    )
    assert GroupsReport.model_validate_json(out) == sample.PREVIEW
    assert [body for _, _, body in api.told] == [{"groups": {"min": 1, "max": 2}, "sigma": "std"}]


@pytest.mark.parametrize("order", ["before", "after"])
def test_settings_are_set_and_those_in_force_are_shown(run: Run, api: _Station, order: str) -> None:
    where = ["--url", api.url, "--format", "json"]
    given = ["alpha=0.7", "hysteresis.gain=0.1", "hysteresis.smoothing=1", "criterion=gain", "groups=auto"]
    words = ["settings", *where, "set", *given] if order == "before" else ["settings", "set", *given, *where]
    code, out, err = run(*words)
    assert (code, err) == (0, "")
    assert LiveSettings.model_validate_json(out) == sample.GROUPS.settings
    patch = {"alpha": 0.7, "hysteresis": {"gain": 0.1, "smoothing": 1}, "criterion": "gain", "groups": "auto"}
    assert api.told == [("PATCH", "/api/v1/settings", patch)]
    assert api.asked == []


@pytest.mark.parametrize(
    "changes",
    [["alpha"], ["=1"], ["hysteresis.=1"], ["a=1", "a=2"], ["h.a=1", "h.a=2"], ["h=1", "h.a=2"], ["h.a=1", "h=2"]],
)
def test_what_is_no_change_is_named(changes: list[str]) -> None:
    with pytest.raises(CovistaError):
        parse_changes(changes)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "auto", "{", ""])
def test_what_is_not_json_is_a_word(text: str) -> None:
    assert parse_changes([f"alpha={text}"]) == {"alpha": text}
    json.dumps(parse_changes([f"alpha={text}"]), allow_nan=False)

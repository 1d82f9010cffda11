"""The similarity matrix in all its forms."""

import contextlib
import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from covista_schemas.reports import Problem
from covista_service.api.negotiation import NotAcceptableError, choose
from hypothesis import given
from hypothesis import strategies as st

from tests.service.answers.test_pieces import swarm
from tests.service.api.conftest import Desk

NPY, CSV, JSON = "application/x-npy", "text/csv", "application/json"
MATRICES = ["similarity", "overlap", "closeness", "distance_m"]


def desk_of(robots: int, monkeypatch: pytest.MonkeyPatch) -> Desk:
    desk = Desk()
    snapshot = replace(desk.scene.snapshot, similarity=swarm(robots, 3).similarity)
    monkeypatch.setattr(desk.parts.loop, "snapshot", lambda: snapshot)
    return desk


@pytest.mark.parametrize("robots", [0, 1, 3, 130])
@pytest.mark.parametrize("matrix", MATRICES)
def test_all_forms_say_the_same(robots: int, matrix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_of(robots, monkeypatch)
    report = desk.get("/similarity").json()
    wanted = np.array(report[matrix], np.float64).reshape(robots, robots)

    response = desk.get(f"/similarity?matrix={matrix}", accept=NPY)
    assert (response.status_code, response.headers["content-type"]) == (200, NPY)
    file = io.BytesIO(response.content)
    values, names = np.load(file), np.load(file)
    assert file.read() == b""
    assert values.dtype == np.float64
    np.testing.assert_array_equal(values, wanted)
    assert [name.decode() for name in names.tolist()] == report["robots"]

    response = desk.get(f"/similarity?matrix={matrix}", accept=CSV)
    assert response.headers["content-type"].startswith(CSV)
    head, *rows = csv.reader(io.StringIO(response.text, newline=""))
    assert head == ["robot", *report["robots"]]
    assert [row[0] for row in rows] == report["robots"]
    table = [[float(cell) if cell else np.nan for cell in row[1:]] for row in rows]
    np.testing.assert_array_equal(np.array(table).reshape(robots, robots), wanted)


def test_each_form_has_a_version_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_of(3, monkeypatch)
    asked = [(JSON, "similarity"), *((form, matrix) for form in (NPY, CSV) for matrix in MATRICES)]
    tags = {}
    for form, matrix in asked:
        response = desk.get(f"/similarity?matrix={matrix}", accept=form)
        assert response.headers["vary"] == "Accept"
        tags[form, matrix] = response.headers["etag"]
    assert len(set(tags.values())) == len(asked)
    for (form, matrix), tag in tags.items():
        known = {"accept": form, "if-none-match": tag}
        assert desk.get(f"/similarity?matrix={matrix}", **known).status_code == 304
        others = ", ".join(other for other in tags.values() if other != tag)
        assert desk.get(f"/similarity?matrix={matrix}", accept=form, **{"if-none-match": others}).status_code == 200


def test_json_does_not_heed_the_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_of(3, monkeypatch)
    assert desk.get("/similarity").headers["etag"] == desk.get("/similarity?matrix=overlap").headers["etag"]


def test_what_nobody_has_is_not_acceptable(desk: Desk) -> None:
    response = desk.get("/similarity", accept="image/png, text/html;q=0.9")
    assert response.status_code == 406
    problem = Problem.model_validate_json(response.content)
    assert problem.detail == "there is application/json, application/x-npy, text/csv"
    assert desk.get("/similarity?matrix=nonsense").status_code == 422


@pytest.mark.parametrize(
    ("accept", "chosen"),
    [
        (None, JSON),
        ("", JSON),
        ("*/*", JSON),
        ("application/*", JSON),
        ("text/*", CSV),
        (NPY, NPY),
        ("application/json;q=0.5, application/x-npy", NPY),
        ("application/x-npy;q=0.1, */*;q=0.2", JSON),
        ("application/json;q=0, */*", NPY),
        ("application/json;q=0, application/x-npy;q=0, */*;q=0.001", CSV),
        ("TEXT/CSV ; Q=0.9 , application/json; q=0.8", CSV),
        ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", JSON),
        ("text/csv;q=nonsense", CSV),
        ("image/png", None),
        ("*/*;q=0", None),
        ("application/json;q=0", None),
    ],
)
def test_the_form_is_the_one_liked_best(accept: str | None, chosen: str | None) -> None:
    if chosen is None:
        with pytest.raises(NotAcceptableError):
            choose(accept, (JSON, NPY, CSV))
    else:
        assert choose(accept, (JSON, NPY, CSV)) == chosen


@given(st.text())
def test_whatever_is_accepted_there_is_a_form_or_none(accept: str) -> None:
    with contextlib.suppress(NotAcceptableError):
        assert choose(accept, (JSON, NPY, CSV)) in (JSON, NPY, CSV)

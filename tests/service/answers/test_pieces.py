from dataclasses import replace

import numpy as np
import pytest
from covista_schemas.reports import PairsReport, SimilarityReport
from covista_service import answers
from covista_service.station.snapshot import SimilarityView, Snapshot
from covista_service.station.station import Station
from hypothesis import given
from hypothesis import strategies as st

from tests.service.station.scenes import BACK, NOTHING, Scene, measured, pose


def swarm(robots: int, seed: int) -> Snapshot:
    """A station that knows some of the overlaps of so many robots."""
    rng = np.random.default_rng(seed)
    S, distance_m = rng.random((robots, robots)), rng.random((robots, robots)) * 100
    overlap = np.where(rng.random((robots, robots)) < 0.5, np.nan, rng.random((robots, robots)))
    view = SimilarityView(seed, tuple(f"r{i}" for i in range(robots)), 3.0, S, overlap, distance_m**2, overlap)
    return replace(Station().snapshot(0), similarity=view)


@given(st.integers(0, 6), st.integers(0, 2**31))
def test_the_text_in_pieces_is_that_of_the_report(robots: int, seed: int) -> None:
    snapshot = swarm(robots, seed)
    text = b"".join(answers.similarity_json(snapshot))
    assert text.decode() == answers.similarity_report(snapshot).model_dump_json()


@pytest.mark.parametrize("robots", [0, 1, 30])
def test_what_is_unknown_is_null_and_the_model_reads_it(robots: int) -> None:
    snapshot = swarm(robots, 1)
    report = SimilarityReport.model_validate_json(b"".join(answers.similarity_json(snapshot)))
    assert sum(each is None for row in report.overlap for each in row) == np.isnan(snapshot.similarity.overlap).sum()


def test_no_piece_is_longer_than_a_row() -> None:
    pieces = list(answers.similarity_json(swarm(50, 2)))
    assert max(map(len, pieces)) < 50 * 25


@pytest.mark.parametrize("robots", [0, 1, 2, 5])
@pytest.mark.parametrize("min_overlap", [None, 0.0, 0.3, 1.0])
def test_pairs_in_pieces_are_those_of_the_report(robots: int, min_overlap: float | None) -> None:
    scene = Scene()
    for number in range(robots):
        scene.send(f"r{number}")
    scene.settle()
    text = b"".join(answers.pairs_json(scene.snapshot, min_overlap))
    assert text.decode() == answers.pairs_report(scene.snapshot, None, min_overlap).model_dump_json()


def sides() -> Snapshot:
    """Eight robots that look ahead, and as many that look back."""
    scene = Scene()
    for number in range(8):
        scene.send(f"a{number}", pose(0.1 * number))
        scene.send(f"b{number}", pose(0.1 * number, BACK))
    scene.settle(lambda job: measured() if job.first.robot[0] == job.second.robot[0] else NOTHING)
    return scene.snapshot


@pytest.mark.parametrize(("min_overlap", "count"), [(None, 120), (0.0, 120), (0.01, 56), (0.6, 56), (0.61, 0)])
def test_pairs_that_share_enough_are_those_of_all(min_overlap: float | None, count: int) -> None:
    snapshot = sides()
    report = PairsReport.model_validate_json(b"".join(answers.pairs_json(snapshot, min_overlap)))
    every = answers.pairs_report(snapshot).pairs
    assert report.pairs == [
        pair for pair in every if max(pair.overlap_a or 0.0, pair.overlap_b or 0.0) >= (min_overlap or 0.0)
    ]
    assert len(report.pairs) == count


def test_who_asks_for_pairs_that_share_something_has_no_others_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    snapshot, looked = sides(), []
    look = Snapshot.pair
    monkeypatch.setattr(Snapshot, "pair", lambda self, a, b: looked.append((a, b)) or look(self, a, b))
    list(answers.pairs_json(snapshot, 0.3))
    assert looked == sorted(snapshot.records)


@pytest.mark.parametrize(("min_overlap", "pauses"), [(None, 6), (0.3, 3), (0.9, 3)])
def test_it_pauses_for_the_pairs_that_were_looked_at(
    min_overlap: float | None, pauses: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    snapshot, paused = sides(), []
    monkeypatch.setattr("covista_service.answers.pieces.time.sleep", paused.append)
    list(answers.pairs_json(snapshot, min_overlap))
    assert paused == [0] * pauses

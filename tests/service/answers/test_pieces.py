from dataclasses import replace

import numpy as np
import pytest
from covista_schemas.reports import SimilarityReport
from covista_service import answers
from covista_service.station.snapshot import SimilarityView, Snapshot
from covista_service.station.station import Station
from hypothesis import given
from hypothesis import strategies as st

from tests.service.station.scenes import Scene


def swarm(robots: int, seed: int) -> Snapshot:
    """A station that knows some of the overlaps of so many robots."""
    rng = np.random.default_rng(seed)
    S, distance_m = rng.random((robots, robots)), rng.random((robots, robots)) * 100
    overlap = np.where(rng.random((robots, robots)) < 0.5, np.nan, rng.random((robots, robots)))
    view = SimilarityView(seed, tuple(f"r{i}" for i in range(robots)), 3.0, S, overlap, distance_m**2)
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

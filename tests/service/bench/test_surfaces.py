from __future__ import annotations

import pytest
from covista_service.bench import predict_surfaces, surface


def test_overlaps_are_read_from_the_surfaces_of_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predict_surfaces, "_ROUNDS", 1)
    monkeypatch.setattr(predict_surfaces, "_FEATURES", 300)
    (row,) = predict_surfaces.rows(long=False)
    assert (row.bench, row.case, row.unit) == ("predict", "surfaces", "pairs/s")
    assert row.median > 0


def test_surfaces_are_timed_by_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface, "_ROUNDS", 1)
    monkeypatch.setattr(surface, "MARKS_MS", {300: 5.0})
    rows = list(surface.rows(long=False))
    assert [row.case for row in rows] == ["surface_300", "surface_300_agree", "surface_300_interpolate"]
    assert all(row.median > 0 for row in rows)

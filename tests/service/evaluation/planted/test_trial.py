from __future__ import annotations

import pytest
from covista_service.evaluation.planted.trial import Trial, figures, size_classes


def trial(robots: int, ari: float, kind: str = "ground", method: str = "a", groups: int = 2, ms: float = 1.0) -> Trial:
    true_groups = {"one": 1, "apart": robots}.get(kind, 3)
    return Trial("measured", method, kind, 0, robots, groups, true_groups, ari, ms)


def test_figures_stand_by_method_size_and_kind() -> None:
    found = figures(
        [trial(8, 0.2), trial(20, 0.4, "wall"), trial(40, 0.6), trial(100, 1.0, "terrain"), trial(8, 0.9, method="b")],
        200,
    )
    first, second = found
    assert (first.method, first.swarms, second.method, second.swarms) == ("a", 4, "b", 1)
    assert first.ari == pytest.approx(0.55)
    assert first.by_size == {"6-12": 0.2, "13-30": 0.4, "31-80": 0.6, "81-200": 1.0}
    assert first.above_30 == pytest.approx(0.8)
    assert first.by_kind == {"ground": pytest.approx(0.4), "wall": 0.4, "corridor": None, "terrain": 1.0}
    assert second.above_30 is None
    assert second.by_size["31-80"] is None


def test_swarms_that_are_one_or_none_count_in_the_whole_alone() -> None:
    (found,) = figures(
        [trial(8, 1.0), trial(40, 1.0, "one", groups=1), trial(40, 0.0, "one"), trial(8, 0.0, "apart")], 200
    )
    assert found.ari == 0.5
    assert found.by_size["31-80"] is None
    assert found.by_size["6-12"] == 1.0
    assert (found.kept_one, found.kept_apart) == (0.5, 0.0)


def test_the_tenth_percentile_and_the_median_time() -> None:
    (found,) = figures([trial(8, k / 10, ms=float(k)) for k in range(11)], 200)
    assert found.tenth == pytest.approx(0.1)
    assert found.ms_median == 5.0


def test_swarms_larger_than_usual_are_a_class_of_their_own() -> None:
    assert list(size_classes(200)) == ["6-12", "13-30", "31-80", "81-200"]
    assert size_classes(500)["201-500"] == (201, 500)

from __future__ import annotations

from covista_service.bench.scene import company, overlapping_pairs
from covista_service.perception.survey import Outcome, SurveyOptions, survey


def test_pairs_have_the_features_asked_for_and_can_be_measured() -> None:
    pairs = overlapping_pairs(300)
    assert pairs
    assert all(len(view.features.keypoints_px) == 300 for pair in pairs for view in pair)
    outcomes = [survey(*pair, SurveyOptions()).outcome for pair in pairs]
    assert outcomes.count(Outcome.MEASURED) >= len(pairs) / 2


def test_a_view_has_company_and_all_have_thumbnails() -> None:
    views = company(300)
    assert len(views) >= 5
    assert all(view.thumbnail is not None and view.thumbnail.shape == (72, 96) for view in views)

from __future__ import annotations

import pytest
from covista_service.bench import predict_poses


def test_a_pose_is_timed_all_in_beside_visibility_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predict_poses, "_ROUNDS", 2)
    monkeypatch.setattr(predict_poses, "_ROBOTS", 80)
    poses, turn = predict_poses.rows(long=False)
    assert (poses.bench, poses.case, turn.case) == ("predict", "poses", "poses_turn")
    assert poses.peer_median is not None
    assert poses.median > 0
    assert poses.peer_median > 0
    assert turn.median > 0

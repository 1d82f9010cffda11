from dataclasses import replace

import numpy as np
import pytest
from covista_service import answers
from covista_service.answers import NotKnownError
from covista_service.dashboard.pair_facts import pair_facts
from covista_service.station.corrections import Correction
from covista_service.station.events import MessageDropped, SurveyPair
from covista_service.station.snapshot import Snapshot
from pydantic_core import to_json

from tests.service.station.scenes import BACK, NOTHING, START_NS, Found, Scene, measured, pose


def two_that_share(find: object = None) -> Scene:
    scene = Scene()
    scene.send("r1", pose(0.0))
    scene.send("r2", pose(0.5))
    scene.settle(lambda job: measured(0.25, 0.75)) if find is None else scene.settle(find)  # type: ignore[arg-type]
    scene.wait(2)
    return scene


@pytest.fixture(scope="module")
def snapshot() -> Snapshot:
    return two_that_share().snapshot


def test_shares_are_told_in_the_order_asked(snapshot: Snapshot) -> None:
    forward, back = pair_facts(snapshot, "r1", "r2"), pair_facts(snapshot, "r2", "r1")
    assert (forward["a"], forward["overlap_a"], forward["overlap_b"]) == ("r1", 0.25, 0.75)
    assert (back["a"], back["overlap_a"], back["overlap_b"]) == ("r2", 0.75, 0.25)
    assert [robot["id"] for robot in back["robots"]] == ["r2", "r1"]


def test_facts_are_those_that_rest_tells(snapshot: Snapshot) -> None:
    facts = pair_facts(snapshot, "r2", "r1")
    told = answers.pair_report(snapshot, "r2", "r1").model_dump(
        mode="json", exclude={"planes", "regions_a", "regions_b"}
    )
    assert {name: facts[name] for name in told} == told
    assert to_json(facts)


def test_likeness_is_that_of_the_matrices(snapshot: Snapshot) -> None:
    facts, matrices = pair_facts(snapshot, "r1", "r2"), snapshot.similarity
    assert matrices.robots == ("r1", "r2")
    assert facts["distance_m"] == pytest.approx(0.5)
    np.testing.assert_allclose(facts["closeness"], matrices.closeness[0, 1])
    assert facts["similarity"] == matrices.similarity[1, 0]


def test_how_a_pair_was_found_is_a_sentence(snapshot: Snapshot) -> None:
    facts = pair_facts(snapshot, "r1", "r2")
    assert facts["how"] == "Found in their images."
    assert facts["why_not"] is None
    assert facts["warnings"] == []


def test_matched_points_are_of_the_last_comparison_where_the_overlap_is_predicted(snapshot: Snapshot) -> None:
    assert pair_facts(snapshot, "r1", "r2")["matched"] == "9 matched points agree."
    scene = two_that_share()
    scene.send_pose("r2", pose(0.6))
    scene.settle()
    facts = pair_facts(scene.snapshot, "r1", "r2")
    assert facts["found_by"] == "predicted"
    assert facts["matched"] == "When their images were last compared, 9 matched points agreed."


def test_images_that_do_not_match_say_so() -> None:
    def nothing(job: SurveyPair) -> Found:
        return NOTHING

    facts = pair_facts(two_that_share(nothing).snapshot, "r1", "r2")
    assert facts["why_not"] == "Too few points of one image are found again in the other."


def test_views_that_cannot_meet_are_told_apart_from_views_that_are_not_known() -> None:
    scene = Scene()
    for number in range(8):
        scene.send(f"a{number}", pose(0.1 * number))
        scene.send(f"b{number}", pose(0.1 * number, BACK))
    scene.settle(lambda job: measured() if job.first.robot[0] == job.second.robot[0] else NOTHING)
    facts = pair_facts(scene.snapshot, "a0", "b7")
    assert (facts["overlap_a"], facts["overlap_b"]) == (0, 0)
    assert facts["how"] == "Their views cannot meet, so they have nothing in common."
    assert facts["matched"] == ""


def test_a_robot_without_a_pose_has_no_distance() -> None:
    scene = two_that_share()
    scene.receive(MessageDropped("r3", "pose", "malformed", "payload: garbage", START_NS, counted=False, count=1))
    scene.settle()
    facts = pair_facts(scene.snapshot, "r1", "r3")
    assert (facts["distance_m"], facts["similarity"], facts["closeness"]) == (None, None, None)
    assert (facts["found_by"], facts["how"]) == ("unknown", "Not known yet.")
    assert [robot["picture"] for robot in facts["robots"]] == [None, None]


def test_who_is_silent_is_named_with_how_long() -> None:
    scene = two_that_share()
    scene.wait(40)
    facts = pair_facts(scene.snapshot, "r1", "r2")
    assert {robot["status"] for robot in facts["robots"]} == {"gone"}
    assert facts["warnings"] == [
        f"{name} is gone, silent for 42 s: what is told of it is from before." for name in ("r1", "r2")
    ]
    assert [robot["silent_s"] for robot in facts["robots"]] == [42, 42]


def test_a_pose_that_images_contradict_is_a_warning_with_its_figures(snapshot: Snapshot) -> None:
    off = replace(snapshot.robots["r2"], correction=Correction(2.04, 0.314, 1))
    seen = replace(snapshot, robots={**snapshot.robots, "r2": off})
    (warning,) = pair_facts(seen, "r1", "r2")["warnings"]
    assert warning == "The pose that r2 reports is 2.0 deg and 0.31 m off what its images say."
    agreeing = replace(snapshot.robots["r2"], correction=Correction(0.1, 0.001, 0))
    assert pair_facts(replace(snapshot, robots={**snapshot.robots, "r2": agreeing}), "r1", "r2")["warnings"] == []


@pytest.mark.parametrize(("a", "b"), [("r1", "r9"), ("r9", "r1"), ("r1", "r1")])
def test_who_is_not_known_or_the_same_is_no_pair(snapshot: Snapshot, a: str, b: str) -> None:
    with pytest.raises(NotKnownError):
        pair_facts(snapshot, a, b)


def test_what_there_is_to_draw_on_is_told(snapshot: Snapshot) -> None:
    assert [robot["picture"] for robot in pair_facts(snapshot, "r1", "r2")["robots"]] == ["features", "features"]

import pytest
from covista_service.answers import NotKnownError
from covista_service.dashboard.why import why
from covista_service.station.events import SurveyPair
from hypothesis import given
from hypothesis import strategies as st

from tests.service.dashboard.conftest import PagesDesk
from tests.service.station.scenes import BACK, NOTHING, Found, Scene, measured, pose

# Two couples, a long way from each other.
PLACES = {"r1": 0.0, "r2": 0.2, "r3": 50.0, "r4": 50.2}


def couples(job: SurveyPair) -> Found:
    near = {job.first.robot, job.second.robot} in ({"r1", "r2"}, {"r3", "r4"})
    return measured(0.75, 0.5) if near else NOTHING


@pytest.fixture(scope="module")
def scene() -> Scene:
    scene = Scene()
    for robot, x_m in PLACES.items():
        scene.send(robot, pose(x_m))
    scene.settle(couples)
    return scene


def test_who_is_together_hears_what_both_see_in_the_order_asked(scene: Scene) -> None:
    together, back = why(scene.snapshot, "r1", "r2"), why(scene.snapshot, "r2", "r1")
    assert together[0].startswith("r1 and r2 are together in g")
    assert "r2 sees 75 % of r1's view, r1 sees 50 % of r2's (found in their images)." in together
    assert "r1 sees 50 % of r2's view, r2 sees 75 % of r1's (found in their images)." in back
    assert together[2].startswith("Their similarity is 0.")


def test_who_is_apart_hears_how_alike_each_is_to_both_groups(scene: Scene) -> None:
    groups = {robot: scene.snapshot.robots[robot].group for robot in PLACES}
    said = why(scene.snapshot, "r1", "r3")
    assert said[0] == f"r1 is in {groups['r1']} and r3 in {groups['r3']}."
    assert said[1] == "They see nothing in common: from where they stand their views cannot meet."
    assert said[2].startswith("Their similarity is 0.")
    assert [line.split(":")[0] for line in said[3:]] == [
        f"r1 belongs more to {groups['r1']}",
        f"r3 belongs more to {groups['r3']}",
    ]


def test_who_is_missing_hears_that_first() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2", pose(0.2))
    scene.settle(lambda job: measured())
    scene.wait(36)
    scene.send("r1")
    scene.settle(lambda job: measured())
    scene.wait(1)
    assert why(scene.snapshot, "r1", "r2")[0] == "r2 is gone, so it stands in no group."


def test_what_is_not_known_is_said() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2", pose(0.2))
    assert "What both see is not known yet." in why(scene.snapshot, "r1", "r2")
    scene.send("r3", pose(0.0, BACK))
    scene.settle(lambda job: NOTHING)
    assert why(scene.snapshot, "r1", "r1") == ["r1 is one robot."]
    with pytest.raises(NotKnownError, match="'r9'"):
        why(scene.snapshot, "r1", "r9")


@given(st.permutations(sorted(PLACES)))
def test_every_pair_has_an_answer_first_and_whole_sentences(scene: Scene, order: list[str]) -> None:
    for line in why(scene.snapshot, order[0], order[1]):
        assert line.endswith(".")
        assert "nan" not in line
        assert "None" not in line


def test_a_page_that_asks_for_who_is_forgotten_gets_an_answer_and_no_error(pages_desk: PagesDesk) -> None:
    pages_desk.scene.send("r1")
    pages_desk.scene.settle()
    assert pages_desk.data("/why?a=r1&b=r9") == {"sentences": [], "problem": "no robot 'r9' is known"}
    assert pages_desk.data("/why?a=r1&b=r1") == {"sentences": ["r1 is one robot."]}

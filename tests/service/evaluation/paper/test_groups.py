"""The paper's groups come out of real camera geometry, and not by a hair."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from covista_service.evaluation.paper import grouped
from covista_service.evaluation.paper.group_tables import LEAST_MARGIN, TABLES, PrintedGroups, group_tables, margin
from covista_service.evaluation.paper.grouped import ADAPTIVE, TWO, Seen
from covista_service.evaluation.paper.layouts import HALL_M, Scenario, hall, plain, scattered, seen
from covista_service.evaluation.paper.mover import ALPHA, LEAST_LEAD, PRINTED, company, mover, snapshot
from covista_service.evaluation.paper.trade_off import measure, trade_off
from covista_service.perception import polygon
from numpy.typing import NDArray

ROWS = [pytest.param(name, row, id=f"{name} {row.interval}") for name, table in TABLES.items() for row in table.rows]
COARSE_PX = 4


def jittered(scenario: Scenario, seed: int) -> Scenario:
    """Every camera a millimetre off, in any direction."""
    off_m = np.random.default_rng(seed).normal(size=(len(scenario.vantages), 3))
    off_m *= 1e-3 / np.linalg.norm(off_m, axis=1, keepdims=True)
    moved = [
        replace(vantage, position_m=tuple((np.array(vantage.position_m) + off).tolist()))
        for vantage, off in zip(scenario.vantages, off_m, strict=True)
    ]
    return replace(scenario, vantages=tuple(moved))


def png(data: bytes) -> NDArray[np.uint8]:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(picture, np.uint8)


@pytest.mark.parametrize(("name", "row"), ROWS)
def test_every_printed_row_comes_out_at_every_printed_alpha(name: str, row: PrintedGroups) -> None:
    known = seen(TABLES[name].scenario)
    assert [grouped.groups(known, alpha, TWO) for alpha in row.alphas] == [row.groups] * len(row.alphas)


@pytest.mark.parametrize("name", TABLES)
def test_no_printed_alpha_is_near_a_switch(name: str) -> None:
    switches = grouped.switches(seen(TABLES[name].scenario), TWO)
    assert len(switches) == len(TABLES[name].rows) - 1
    assert margin(switches) >= LEAST_MARGIN


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", TABLES)
def test_a_millimetre_changes_no_printed_group(name: str, seed: int) -> None:
    known = seen(jittered(TABLES[name].scenario, seed), COARSE_PX)
    for row in TABLES[name].rows:
        assert {grouped.groups(known, alpha, TWO) for alpha in row.alphas} == {row.groups}


@pytest.mark.parametrize("k", range(6))
def test_the_mover_has_the_company_that_is_drawn_and_a_millimetre_does_not_change_it(k: int) -> None:
    for known in (seen(snapshot(k)), seen(jittered(snapshot(k), k), COARSE_PX)):
        found = grouped.groups(known, ALPHA, ADAPTIVE)
        assert (len(found), company(found)) == PRINTED[k]
        assert grouped.lead(known, ALPHA, ADAPTIVE) >= LEAST_LEAD


def test_by_overlap_alone_three_snapshots_are_one_and_the_mover_is_alone_in_them() -> None:
    alone = {grouped.groups(seen(snapshot(k)), 1.0, ADAPTIVE) for k in (2, 3, 4)}
    assert alone == {((1,), (2, 3), (4, 5, 6), (7, 8, 9))}
    assert all(not seen(snapshot(k)).overlap[0, 1:].any() for k in (2, 3, 4))


@pytest.mark.parametrize("shift_m", [(0.0, 0.0), (3.1, 0.0), (-2.0, 4.4), (9.0, 6.0), (9.5, 0.0)])
def test_cameras_looking_down_share_what_their_rectangles_share(shift_m: tuple[float, float]) -> None:
    overlap = seen(plain("two", [(0.0, 0.0), shift_m])).overlap
    across, along = (max(0.0, 1 - abs(by) / size) for by, size in zip(shift_m, (9.28, 6.96), strict=True))
    assert overlap == pytest.approx(np.array([[1, across * along], [across * along, 1]]), abs=0.02)


def test_a_level_camera_sees_a_wedge_of_the_hall() -> None:
    view_m = hall("one", [(7.0, 5.0, 1.0, 0.0)]).views_m[0]
    # 60 degrees across and 7 m to the wall: a triangle whose far side is 2 x 7 tan 30.
    assert polygon.area([(x, y) for x, y in view_m.tolist()]) == pytest.approx(49 * np.tan(np.pi / 6))
    assert view_m.min(axis=0)[0] == pytest.approx(7.0)


def test_face_to_face_and_back_to_back() -> None:
    face = seen(hall("face", [(4.0, 5.0, 1.0, 0.0), (10.0, 5.0, 1.0, 0.0)])).overlap
    back = seen(hall("back", [(4.0, 5.0, 1.0, 180.0), (10.0, 5.0, 1.0, 0.0)])).overlap
    # Who stands farther back sees all that the other one does, and more.
    assert face[1, 0] == pytest.approx(1.0)
    assert 0 < face[0, 1] < 0.5
    assert not back[0, 1] + back[1, 0]


def test_scattered_cameras_stand_in_the_hall_and_depend_on_the_seed_alone() -> None:
    one, same, other = (scattered("20", 20, seed).position_m for seed in (0, 0, 1))
    assert (one == same).all()
    assert (one != other).any()
    assert ((one > 0) & (one < HALL_M)).all()


def test_means_are_over_groups_and_who_is_alone_has_no_pair() -> None:
    values = np.array([[1.0, 0.2, 0.4, 0.9], [0.2, 1.0, 0.6, 0.9], [0.4, 0.6, 1.0, 0.9], [0.9, 0.9, 0.9, 1.0]])
    assert grouped.within(values, np.array([0, 0, 0, 1])) == pytest.approx(0.4)
    assert grouped.within(values, np.array([0, 0, 1, 1])) == pytest.approx(0.55)
    assert grouped.within(values, np.arange(4)) == 0.0


def test_a_switch_is_found_where_distance_and_overlap_weigh_the_same() -> None:
    """Two near each other and two that see the same, of four: by symmetry the groups change at one half."""
    near = np.array([[0.0, 1.0, 3.0, 3.0], [1.0, 0.0, 3.0, 3.0], [3.0, 3.0, 0.0, 1.0], [3.0, 3.0, 1.0, 0.0]])
    closeness = Seen(np.eye(4), near).closeness
    order = [0, 2, 1, 3]
    known = Seen(closeness[np.ix_(order, order)], near)
    # Steps that miss one half, where everything is a tie.
    (at,) = grouped.switches(known, TWO, 33)
    assert at == pytest.approx(0.5, abs=1e-3)
    assert grouped.text(grouped.groups(known, 0.4, TWO)) == "{1,2} {3,4}"
    assert grouped.text(grouped.groups(known, 0.6, TWO)) == "{1,3} {2,4}"


def test_labels_follow_the_groups_of_the_snapshots() -> None:
    found = [grouped.groups(seen(snapshot(k)), ALPHA, ADAPTIVE) for k in range(6)]
    labelled = list(grouped.followed(found))
    for camera in range(2, 10):
        assert len({label for groups in labelled for label, who in groups.items() if camera in who}) == 1
    ((fresh, who),) = ((label, who) for label, who in labelled[3].items() if label not in labelled[2])
    assert who == (1,)
    assert fresh not in labelled[4]


def test_more_overlap_and_less_closeness_as_alpha_grows() -> None:
    found = measure(TABLES["Table III"].scenario, 2, [k / 10 for k in range(11)])
    assert (np.diff(found.overlap) >= 0).all()
    assert (np.diff(found.closeness) <= 0).all()
    assert found.overlap[0] < found.overlap[-1] / 3


def test_chapters_agree_and_are_drawn() -> None:
    told: list[str] = []
    chapters = (
        group_tables(told.append, ["Table II"]),
        trade_off(told.append, [(10, 2)], [0.0, 0.5, 1.0]),
        mover(told.append),
    )
    items = [item for chapter in chapters for item in chapter.items]
    assert {item.item for item in items} >= {"Table II", "Fig. 5", "Fig. 7", "Fig. 8"}
    assert [item for item in items if not item.agrees] == []
    assert len(told) == 3
    drawn = {name: png(data) for chapter in chapters for name, data in chapter.pictures.items()}
    assert drawn.keys() == {
        "table_2.png",
        "table_2_groups.png",
        "fig_5_scenario_1.png",
        "fig_7.png",
        "fig_8.png",
        "fig_8_default.png",
    }
    assert all(picture.shape[1] > 400 and picture.std() > 5 for picture in drawn.values())
    assert (drawn["fig_8.png"] != drawn["fig_8_default.png"]).any()
    # Three rows of two panels.
    assert drawn["fig_8.png"].shape[0] > 1.5 * drawn["table_2_groups.png"].shape[0]

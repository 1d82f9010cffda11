import pytest
from covista_clients.rover.last_words import LastWords
from covista_schemas.reports import KeyframeId, PoseReport, RobotReport, time_of

from tests.clients.ground import report_on

BOOT = "b1"


def heard(sequence: int, boot: str = BOOT) -> RobotReport:
    return report_on("r1", boot=boot, heard=KeyframeId(boot=boot, sequence=sequence))


def after(*sequences: int) -> LastWords:
    words = LastWords(BOOT)
    for sequence in sequences:
        words.keyframe_sent(sequence, b"%d" % sequence)
    return words


def counts(words: LastWords) -> tuple[int, int]:
    return words.keyframes_resent, words.keyframes_lost


def test_nothing_said_is_nothing_to_say_again() -> None:
    words = LastWords(BOOT)
    assert not words.any
    assert words.unheard_keyframe(None, superseded=False) is None
    assert words.unheard_pose(None) is None
    assert counts(words) == (0, 0)


@pytest.mark.parametrize("newest", [7, 8])
def test_what_was_heard_is_not_said_again(newest: int) -> None:
    words = after(*range(8))
    assert words.unheard_keyframe(heard(newest), superseded=False) is None
    assert counts(words) == (0, 0)


def test_the_newest_is_said_again_and_those_before_it_are_lost() -> None:
    words = after(*range(8))
    assert words.unheard_keyframe(heard(4), superseded=False) == b"7"
    assert counts(words) == (1, 2)


def test_one_that_gives_way_to_a_newer_one_is_lost_with_the_others() -> None:
    words = after(*range(8))
    assert words.unheard_keyframe(heard(4), superseded=True) is None
    assert counts(words) == (0, 3)


@pytest.mark.parametrize("superseded", [False, True])
def test_nothing_is_lost_twice(superseded: bool) -> None:
    """The link breaks again before the station hears anything."""
    words = after(*range(8))
    for _ in range(3):
        words.unheard_keyframe(heard(4), superseded=superseded)
    assert words.keyframes_lost == (3 if superseded else 2)
    words.keyframe_sent(8, b"8")
    assert words.unheard_keyframe(heard(4), superseded=False) == b"8"
    assert words.keyframes_lost == 3


@pytest.mark.parametrize("report", [None, report_on("r1", boot=BOOT), heard(9, "another")])
def test_a_station_that_knows_no_keyframe_of_this_boot_hears_the_newest_and_tells_of_no_loss(
    report: RobotReport | None,
) -> None:
    words = after(0, 1, 2)
    assert words.unheard_keyframe(report, superseded=False) == b"2"
    assert counts(words) == (1, 0)


def test_a_pose_is_said_again_unless_that_or_a_later_one_is_known() -> None:
    words = LastWords(BOOT)
    words.pose_sent(5_000, b"pose")
    told = {"position_m": (0, 0, 0), "orientation_xyzw": (0, 0, 0, 1)}

    def known(time_ns: int, boot: str = BOOT) -> RobotReport:
        return report_on("r1", boot=boot, pose=PoseReport(time=time_of(time_ns), **told))

    for report in (None, report_on("r1", boot=BOOT), known(4_000), known(6_000, "another")):
        assert words.unheard_pose(report) == b"pose"
    for report in (known(5_000), known(6_000)):
        assert words.unheard_pose(report) is None
    assert words.poses_resent == 4

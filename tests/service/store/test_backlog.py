"""What is lost is lost once: all gaps together lack what went, whatever fails and whatever is lost meanwhile."""

from covista_schemas.reports import FoundBy
from covista_service.store.backlog import Backlog, Loss
from covista_service.store.rows import PairEntry, TrackEntry
from hypothesis import given
from hypothesis import strategies as st

from tests.service.store.test_archive import POSE, event


def moment(number: int) -> PairEntry:
    return PairEntry("a", "b", number, None, None, FoundBy.UNKNOWN)


def test_what_is_lost_while_a_batch_is_written_is_another_gap() -> None:
    backlog = Backlog(1)
    backlog.sample([moment(1), moment(2)])
    batch, loss = backlog.take(5), backlog.take_loss()
    assert loss == Loss(1, 1, 1)
    backlog.sample([moment(3), moment(4)])
    backlog.written(batch)
    assert backlog.take_loss() == Loss(3, 3, 1)
    assert backlog.take_loss() is None


def test_a_gap_that_could_not_be_written_is_one_with_what_is_lost_meanwhile() -> None:
    backlog = Backlog(1)
    backlog.sample([moment(1), moment(2)])
    batch, loss = backlog.take(5), backlog.take_loss()
    backlog.sample([moment(7)])
    backlog.put_back(batch, loss)
    assert backlog.take_loss() == Loss(1, 2, 2)
    assert backlog.lost == 2


@given(
    st.integers(1, 4),
    st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6), st.sampled_from(["written", "put back"])), max_size=20),
)
def test_all_that_came_is_written_or_missing_or_waits(most: int, turns: list[tuple[int, int, str]]) -> None:
    backlog, came, written, marked = Backlog(most), 0, 0, 0
    for before, meanwhile, outcome in turns:
        came += before + meanwhile
        backlog.sample(TrackEntry("r1", number, POSE) for number in range(before))
        batch, loss = backlog.take(3), backlog.take_loss()
        backlog.tell([event(number, number) for number in range(meanwhile)])
        if outcome == "written":
            backlog.written(batch)
            written += len(batch)
            marked += 0 if loss is None else loss.lost
        else:
            backlog.put_back(batch, loss)
        left = backlog.take_loss()
        backlog.put_back((), left)
        missing = 0 if left is None else left.lost
        assert marked + missing == backlog.lost
        assert written + backlog.lost + len(backlog) == came

"""Accounts are exact: whatever is lost, repeated or late, every message is somewhere, once."""

from collections import Counter

from covista_service.station.ledger import (
    FORGOTTEN,
    MAX_BOOTS,
    MAX_INTERVALS,
    Counts,
    Ledger,
    Run,
    Sequences,
    Total,
)
from hypothesis import given
from hypothesis import strategies as st


def balanced(counts: Counts) -> bool:
    decided = counts.used + counts.replaced + counts.duplicate + sum(counts.dropped.values())
    return counts.received == decided + counts.waiting


@given(st.lists(st.integers(0, 40)))
def test_intervals_know_what_a_set_knows(numbers: list[int]) -> None:
    sequences, seen = Sequences(), set[int]()
    for number in numbers:
        assert sequences.add(number) is (number not in seen)
        seen.add(number)
        assert sequences.missing == max(seen) + 1 - len(seen)
    assert all((number in sequences) is (number in seen) for number in range(42))


@given(
    boots=st.lists(st.integers(1, 30), min_size=1, max_size=3),
    data=st.data(),
)
def test_sent_is_received_and_missing(boots: list[int], data: st.DataObject) -> None:
    sent = [(f"b{boot}", number) for boot, count in enumerate(boots) for number in range(count)]
    lost = data.draw(st.sets(st.sampled_from(sent)))
    # The last of each boot arrives: what is lost after it nobody can know.
    last = {(boot, max(number for other, number in sent if other == boot)) for boot, _ in sent}
    arrived = data.draw(st.permutations([message for message in sent if message in last or message not in lost]))
    repeated = data.draw(st.lists(st.sampled_from(arrived), max_size=6))
    arrivals = data.draw(st.permutations([*arrived, *repeated]))
    fates = data.draw(st.lists(st.sampled_from(["used", "replaced", "rejected", "unreadable", "open"]), min_size=1))

    ledger, at, step = Ledger(), 0, 0
    while at < len(arrivals):
        burst = arrivals[at : at + 1 + step % 3]
        ledger.hear(burst, burst[-1])
        deliver(ledger, burst[-1], fates[step % len(fates)])
        assert balanced(ledger.counts())
        at += len(burst)
        step += 1
    counts = ledger.counts()
    # A duplicate is a message put twice.
    assert len(sent) + len(repeated) == counts.received + counts.missing
    assert counts.received == len(arrivals)
    assert counts.duplicate == sum(Counter(arrivals).values()) - len(set(arrivals))


def deliver(ledger: Ledger, message: tuple[str, int], fate: str) -> None:
    if fate == "unreadable":
        ledger.drop("bad", 1, counted=True)
    elif ledger.take(message):
        if fate == "rejected":
            ledger.reject(message, "bad")
        elif fate in ("used", "replaced"):
            ledger.settle(message, fate)


def test_what_was_replaced_in_the_mailbox_is_counted() -> None:
    ledger = Ledger()
    ledger.hear([("b", 0), ("b", 1), ("b", 2)], ("b", 2))
    assert ledger.counts() == Counts(received=3, replaced=2, waiting=1)
    assert ledger.take(("b", 2))
    ledger.settle(("b", 2), "used")
    assert ledger.counts() == Counts(received=3, replaced=2, used=1)


def test_a_late_arrival_is_missing_no_longer() -> None:
    ledger = Ledger()
    ledger.hear([("b", 0), ("b", 3)], None)
    assert ledger.counts().missing == 2
    ledger.hear([("b", 1)], None)
    assert ledger.counts().missing == 1


def test_a_message_is_taken_once() -> None:
    ledger = Ledger()
    assert ledger.take(("b", 0))
    assert not ledger.take(("b", 0))
    ledger.settle(("b", 0), "used")
    ledger.hear([("b", 0)], ("b", 0))
    assert not ledger.take(("b", 0))
    assert ledger.counts() == Counts(received=2, used=1, duplicate=1)


def test_messages_without_a_readable_number_are_received_and_dropped() -> None:
    ledger = Ledger()
    ledger.drop("malformed", 3, counted=False)
    ledger.hear([("b", 0)], ("b", 0))
    ledger.drop("bad_pose", 1, counted=True)
    assert ledger.counts() == Counts(received=4, dropped={"malformed": 3, "bad_pose": 1})


def test_a_duplicate_that_cannot_be_read_is_a_duplicate() -> None:
    ledger = Ledger()
    ledger.hear([("b", 0)], None)
    ledger.hear([("b", 0)], ("b", 0))
    ledger.drop("bad", 1, counted=True)
    assert ledger.counts() == Counts(received=2, replaced=1, duplicate=1)


def test_gaps_without_end_take_no_more_room_and_stay_counted() -> None:
    sequences = Sequences()
    count = 3 * MAX_INTERVALS
    for number in range(count):
        sequences.add(2 * number)
    assert sequences.missing == count - 1
    assert len(sequences._starts) <= MAX_INTERVALS
    assert 2 * count - 3 not in sequences


def test_boots_without_end_take_no_more_room_and_stay_counted() -> None:
    ledger = Ledger()
    for boot in range(3 * MAX_BOOTS):
        ledger.hear([(f"b{boot}", 0), (f"b{boot}", 2)], None)
    assert ledger.counts() == Counts(received=6 * MAX_BOOTS, replaced=6 * MAX_BOOTS, missing=3 * MAX_BOOTS)
    assert len(ledger._boots) == MAX_BOOTS


steps = st.tuples(
    st.integers(0, 2),
    st.sampled_from(["announce", "take", "settle", "reject", "unreadable", "broken", "close"]),
    st.integers(0, 9),
)


@given(st.lists(steps, max_size=60))
def test_totals_are_sums_and_never_fall_when_a_ledger_is_closed(steps: list[tuple]) -> None:
    closed, ledgers, before = Total(), [Ledger() for _ in range(3)], Counts()
    for which, step, number in steps:
        enter(ledgers[which], step, number)
        if step == "close":
            ledgers[which].add_to(closed)
            ledgers[which] = Ledger()
        now = closed.copy()
        for ledger in ledgers:
            ledger.add_to(now)
        total, parts = now.counts(), [closed.counts(), *(ledger.counts() for ledger in ledgers)]
        for fate in ("received", "used", "replaced", "duplicate", "missing", "waiting"):
            assert getattr(total, fate) == sum(getattr(counts, fate) for counts in parts)
        for fate in ("received", "used", "replaced", "duplicate"):
            assert getattr(total, fate) >= getattr(before, fate)
        assert all(total.dropped[code] >= count for code, count in before.dropped.items())
        assert balanced(total)
        assert closed.waiting == 0
        before = total


def enter(ledger: Ledger, step: str, number: int) -> None:
    message = ("b", number)
    match step:
        case "announce":
            ledger.hear([message], message)
        case "unreadable":
            ledger.drop("bad", 1, counted=True)
        case "broken":
            ledger.drop("malformed", number, counted=False)
        case "close":
            ledger.close()
        case _ if ledger.take(message) and step == "settle":
            ledger.settle(message, "used")
        case "reject" if message in ledger._open:
            ledger.reject(message, "bad")


def test_of_a_closed_ledger_nothing_waits() -> None:
    ledger = Ledger()
    ledger.hear([("b", 0), ("b", 2)], ("b", 2))
    ledger.close()
    assert ledger.counts() == Counts(received=2, replaced=1, missing=1, dropped={FORGOTTEN: 1})


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 12))))
def test_a_run_is_heard_as_its_numbers_are(runs: list[tuple[int, int]]) -> None:
    at_once, one_by_one = Sequences(), Sequences()
    for first, length in runs:
        numbers = range(first, first + length)
        assert at_once.add_run(first, first + length, length) == sum([one_by_one.add(number) for number in numbers])
        assert at_once.missing == one_by_one.missing
    assert all((number in at_once) is (number in one_by_one) for number in range(60))


@given(st.sets(st.integers(0, 100), min_size=1), st.sets(st.integers(0, 100)))
def test_of_a_run_with_gaps_the_count_stays_exact(given_up: set[int], named: set[int]) -> None:
    ledger, named = Ledger(), named - given_up
    ledger.give_up("overflow", [Run("b0", min(given_up), max(given_up) + 1, len(given_up))])
    counts = ledger.counts()
    assert counts.received + counts.missing == max(given_up) + 1
    assert counts.dropped == {"overflow": len(given_up)}
    later = {number for number in named if number > max(given_up)}
    ledger.hear([("b0", number) for number in sorted(later)], None)
    counts = ledger.counts()
    assert counts.received + counts.missing == max(given_up | later) + 1
    assert balanced(counts)


def test_runs_without_end_take_no_more_room_and_stay_counted() -> None:
    sequences, count = Sequences(), 3 * MAX_INTERVALS
    for number in range(count):
        assert sequences.add_run(3 * number, 3 * number + 2, 2) == 2
    assert len(sequences._starts) <= MAX_INTERVALS
    assert sequences.missing == count - 1

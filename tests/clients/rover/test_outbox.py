import threading

from covista_clients.rover.outbox import Outbox
from hypothesis import given
from hypothesis import strategies as st


def always() -> bool:
    return True


@given(st.lists(st.integers(1, 5)))
def test_numbers_have_no_gaps_and_the_newest_wins(bursts: list[int]) -> None:
    outbox: Outbox[int] = Outbox()
    made = 0
    for number, burst in enumerate(bursts):
        numbers = {outbox.offer(made + k) for k in range(burst)}
        made += burst
        assert numbers == {number}
        assert outbox.take(always) == (number, made - 1)
    assert outbox.replaced == made - len(bursts)


def test_while_one_is_being_sent_the_next_has_its_own_number() -> None:
    outbox: Outbox[str] = Outbox()
    assert outbox.offer("first") == 0
    assert outbox.take(always) == (0, "first")
    assert outbox.offer("second") == 1
    assert outbox.take(always) == (1, "second")


def test_what_nobody_wants_waits_and_is_replaced() -> None:
    outbox: Outbox[str] = Outbox()
    outbox.offer("old")
    outbox.wake()
    assert outbox.take(lambda: False) is None
    outbox.offer("new")
    assert outbox.take(always) == (0, "new")


def test_draining_waits_until_the_last_one_is_sent() -> None:
    outbox: Outbox[str] = Outbox()
    assert outbox.drain(0)
    outbox.offer("one")
    assert not outbox.drain(0)
    outbox.take(always)
    assert not outbox.drain(0)
    sender = threading.Thread(target=outbox.take, args=(always,))
    sender.start()
    assert outbox.drain(5)
    outbox.close()
    sender.join()


def test_closing_ends_a_wait() -> None:
    outbox: Outbox[str] = Outbox()
    taken: list[object] = []
    sender = threading.Thread(target=lambda: taken.append(outbox.take(always)))
    sender.start()
    outbox.close()
    sender.join()
    assert taken == [None]
    assert outbox.closed


def test_a_wait_ends_by_itself() -> None:
    outbox: Outbox[str] = Outbox()
    assert outbox.take(always, 0) is None
    assert not outbox.waits
    outbox.offer("one")
    assert outbox.waits
    assert outbox.take(always, 0) == (0, "one")

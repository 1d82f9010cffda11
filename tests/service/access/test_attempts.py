from dataclasses import dataclass

import pytest
from covista_service.access import Attempts
from covista_service.access.attempts import client_of
from hypothesis import given
from hypothesis import strategies as st


@dataclass
class Clock:
    now_s: float = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_ten_failures_a_minute_and_then_it_says_how_long_to_wait() -> None:
    clock = Clock()
    attempts = Attempts(10, clock=clock)
    assert [attempts.fail("10.0.0.1") for _ in range(10)] == [0] * 10
    wait_s = attempts.fail("10.0.0.1")
    assert wait_s == 6
    clock.now_s += wait_s - 0.5
    assert attempts.fail("10.0.0.1") == 1
    clock.now_s += 0.5
    assert attempts.fail("10.0.0.1") == 0
    assert attempts.fail("10.0.0.1") == 6


def test_a_minute_of_peace_makes_it_forget() -> None:
    clock = Clock()
    attempts = Attempts(10, clock=clock)
    for _ in range(50):
        attempts.fail("10.0.0.1")
    clock.now_s += 60
    assert [attempts.fail("10.0.0.1") for _ in range(10)] == [0] * 10


def test_one_address_does_not_use_up_anothers() -> None:
    attempts = Attempts(3, clock=Clock())
    for _ in range(5):
        attempts.fail("10.0.0.1")
    assert attempts.fail("10.0.0.2") == 0


@given(st.lists(st.floats(0, 20), min_size=1, max_size=200))
def test_never_more_pass_than_the_bucket_and_what_flows_out_of_it(pauses: list[float]) -> None:
    clock = Clock()
    attempts = Attempts(10, clock=clock)
    passed = 0
    for pause_s in pauses:
        clock.now_s += pause_s
        passed += attempts.fail("a") == 0
    assert passed <= 10 + (clock.now_s - 100) / 6 + 1e-6


@given(st.lists(st.integers(0, 500), max_size=300))
def test_there_are_never_more_addresses_than_room(addresses: list[int]) -> None:
    attempts = Attempts(addresses=16)
    for number in addresses:
        attempts.fail(f"10.0.{number // 256}.{number % 256}")
        assert len(attempts) <= 16


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("2001:db8::1", "2001:db8::ffff:1:2:3", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("::ffff:10.0.0.1", "10.0.0.1", True),
        ("::ffff:10.0.0.1", "::ffff:10.0.0.2", False),
        ("fe80::1%eth0", "fe80::2%eth0", True),
        ("10.0.0.1", "10.0.0.2", False),
        ("", "", True),
        ("no address", "no address", True),
    ],
)
def test_a_client_is_an_address_or_a_network_of_ipv6(one: str, other: str, same: bool) -> None:
    assert (client_of(one) == client_of(other)) is same

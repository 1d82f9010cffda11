from covista_service.dashboard.rounds import Rounds
from covista_service.telemetry import Telemetry


def test_all_who_ask_at_the_same_time_are_told_the_same_look() -> None:
    now_s = [10.0]
    rounds = Rounds(lambda: now_s[0])
    looks = iter([b"first", b"second"])
    assert [rounds.told(lambda: next(looks)) for _ in range(3)] == [b"first"] * 3
    now_s[0] += 1
    assert rounds.told(lambda: next(looks)) == b"second"


def test_latencies_are_summed_up_less_often_than_the_station_is_looked_at() -> None:
    now_s = [10.0]
    rounds, telemetry = Rounds(lambda: now_s[0]), Telemetry()
    assert rounds.summary(telemetry.summary).surveys == 0
    telemetry.surveyed("measured")
    now_s[0] += 4
    assert rounds.summary(telemetry.summary).surveys == 0
    now_s[0] += 1
    assert rounds.summary(telemetry.summary).surveys == 1

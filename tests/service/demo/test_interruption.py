from __future__ import annotations

import os
import signal
from multiprocessing import Pipe

import pytest
from covista_service.demo.interruption import listening


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_wait_and_is_counted(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with listening() as interruption:
        os.kill(os.getpid(), number)
        assert interruption.wait([], 20.0) == []
        assert interruption.count == 1
    assert signal.getsignal(number) is before


def test_messages_end_the_wait_too() -> None:
    ours, theirs = Pipe()
    with ours, theirs, listening() as interruption:
        assert interruption.wait([ours], 0.0) == []
        theirs.send("news")
        assert interruption.wait([ours], 20.0) == [ours]
        assert interruption.count == 0

"""How long is the survey of a pair, against OpenCV's brute-force matcher on the same descriptors?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

import cv2
import numpy as np

from covista_service.bench.row import Row, alternately_ms, median, spread
from covista_service.bench.scene import overlapping_pairs
from covista_service.bench.threads import one_thread
from covista_service.perception.camera import View
from covista_service.perception.survey import SurveyOptions, survey

PEER = "OpenCV BFMatcher.knnMatch, both directions"
# Features of each image, and the time a survey may take.
MARKS_MS = {500: 10.0, 1000: 20.0}
_ROUNDS, _LONG_ROUNDS = 7, 40


def rows(long: bool) -> Iterator[Row]:
    """`survey/cold_500` and `survey/cold_1000`: all stages, RootSIFT, one core, nothing to start from."""
    with one_thread():
        for count, mark_ms in MARKS_MS.items():
            yield _cold(count, mark_ms, _LONG_ROUNDS if long else _ROUNDS)


def _cold(count: int, mark_ms: float, rounds: int) -> Row:
    pairs = overlapping_pairs(count)
    calls = [call for pair in pairs for call in (_ours(*pair), _peer(*pair))]
    times = alternately_ms(calls, rounds)
    ours, peer = list(chain(*times[::2])), list(chain(*times[1::2]))
    return Row(
        bench="survey",
        case=f"cold_{count}",
        median=median(ours),
        spread=spread(ours),
        unit="ms",
        peer=PEER,
        peer_median=median(peer),
        mark=f"<= {mark_ms:g} ms and <= peer",
        holds=median(ours) <= min(mark_ms, median(peer)),
    )


def _ours(first: View, second: View) -> Callable[[], object]:
    return lambda: survey(first, second, SurveyOptions())


def _peer(first: View, second: View) -> Callable[[], object]:
    # As float32, which OpenCV matches seven times faster than bytes.
    one, two = (view.features.descriptors.astype(np.float32) for view in (first, second))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    return lambda: (matcher.knnMatch(one, two, k=2), matcher.knnMatch(two, one, k=2))

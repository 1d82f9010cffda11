"""How long OpenCV's brute-force matcher takes, as something to hold the station against."""

from __future__ import annotations

import time

import cv2
import numpy as np
from covista_clients.simulation.stock import Stock

_ROUNDS = 15


def brute_force_ms(stock: Stock) -> list[float]:
    """Times to match the descriptors of two keyframes of a stock, the two nearest in both directions, on one core."""
    shots = [shot for shots in stock.shots for shot in shots[:2]]
    one, two = (shot.features.descriptors.astype(np.float32) for shot in (shots[0], shots[-1]))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    threads, times_ms = cv2.getNumThreads(), []
    cv2.setNumThreads(1)
    try:
        for _ in range(_ROUNDS):
            begin_ns = time.perf_counter_ns()
            matcher.knnMatch(one, two, k=2)
            matcher.knnMatch(two, one, k=2)
            times_ms.append((time.perf_counter_ns() - begin_ns) / 1e6)
    finally:
        cv2.setNumThreads(threads)
    return times_ms

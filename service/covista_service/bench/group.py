"""How long is a regrouping, with the number of groups, and how long the news of one robot? Beside scikit-learn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
from covista_schemas.errors import MissingExtraError

from covista_service.bench import group_calls
from covista_service.bench.group_calls import Call, affinity_of, swarm_of
from covista_service.bench.group_swarm import affinity
from covista_service.bench.row import Row, alternately_ms, median, timed
from covista_service.bench.threads import one_thread
from covista_service.grouping.affinity import Affinity

PEER = "scikit-learn's SpectralClustering for one number of groups"
# By the number of robots: time of a regrouping by the default criterion, and by gain from the last labels.
MARKS_MS = {100: 5.0, 1000: 30.0}
GAIN_MARKS_MS = {100: 0.3, 1000: 10.0}
# Of one pose among so many.
POSE_MARKS_MS = {1000: 0.2}
# So many times faster than the peer; it takes seconds for more robots.
_FASTER = 7.0
_PEER_UP_TO = 100
# The share of pairs whose overlap is not known.
_UNKNOWN = 0.1
_SEED = 1
REPORTED = "reported"
_ROUNDS, _LONG_ROUNDS = 11, 60


def rows(long: bool) -> Iterator[Row]:
    """`group/n100`, `group/n1000`: how many groups, and which, from a similarity matrix; nothing to start from.

    `group/gain_n*`: the same by the criterion gain, from the labels of before one robot went over to another group.
    `group/row_n1000`, `group/see_n1000`: its new position, and its overlaps with thirty neighbours, entered.
    `group/read_n1000`, `group/read_unknown_n1000`: the similarity matrix of that, with all overlaps known and with a
    tenth unknown. `group/weigh_n1000`: hysteresis where nothing changes. `group/evaluate_n1000`: all that a station
    does, from news of a robot to groups with labels. All on one core.
    """
    rounds = _LONG_ROUNDS if long else _ROUNDS
    with one_thread():
        for count, mark_ms in MARKS_MS.items():
            yield _regrouping(count, mark_ms, rounds)
        for count, mark_ms in GAIN_MARKS_MS.items():
            times = alternately_ms(group_calls.regrouping_after_news(count), rounds)
            yield _row(f"gain_n{count}", mark_ms, list(chain(*times)))
        for count, mark_ms in POSE_MARKS_MS.items():
            yield from _events(count, mark_ms, rounds)


def _regrouping(count: int, mark_ms: float, rounds: int) -> Row:
    calls = [group_calls.regrouping(count, "adaptive")]
    if count <= _PEER_UP_TO:
        calls.append(_peer(count))
    return _row(f"n{count}", mark_ms, *alternately_ms(calls, rounds))


def _events(count: int, mark_ms: float, rounds: int) -> Iterator[Row]:
    # Many poses and overlaps come between two readings.
    news = {"row": group_calls.moving(count), "see": group_calls.seeing(count)}
    told = {
        "read": group_calls.reading(affinity_of(count)),
        "read_unknown": group_calls.reading(_known_in_part(count)),
        "weigh": group_calls.weighing(count),
        "evaluate": group_calls.evaluating(count),
    }
    for calls in (news, told):
        times = alternately_ms(list(calls.values()), rounds)
        for case, taken in zip(calls, times, strict=True):
            yield _row(f"{case}_n{count}", mark_ms if case == "row" else None, taken)


def _known_in_part(count: int) -> Affinity:
    known = np.random.default_rng(_SEED).random((count, count)) >= _UNKNOWN
    return affinity(swarm_of(count), known)


def _row(case: str, mark_ms: float | None, times_ms: Sequence[float], peer_ms: Sequence[float] | None = None) -> Row:
    figure, mark, holds = median(times_ms), REPORTED, True
    if mark_ms is not None:
        mark, holds = f"<= {mark_ms:g} ms", figure <= mark_ms
    if peer_ms is not None:
        mark, holds = f"{mark} and peer / {_FASTER:g}", holds and _FASTER * figure <= median(peer_ms)
    return timed("group", case, times_ms, mark, holds=holds, peer=PEER, peer_ms=peer_ms)


def _peer(count: int) -> Call:
    """It is told the number of groups that were planted. Raises MissingExtraError."""
    try:
        from sklearn.cluster import SpectralClustering
    except ImportError as error:
        raise MissingExtraError("scikit-learn, to compare with", "bench") from error
    swarm = swarm_of(count)
    S, told = swarm.similarity(), int(swarm.groups.max()) + 1
    return lambda: SpectralClustering(n_clusters=told, affinity="precomputed", random_state=0).fit_predict(S)

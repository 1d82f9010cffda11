"""What robots have in common, by what each has before it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from covista_schemas.reports import FoundBy
from numpy.typing import NDArray

from covista_service.perception.camera import relatives
from covista_service.perception.certainty import CertaintyOptions, intervals
from covista_service.perception.visibility import Gallery, Seeing, VisibilityOptions, looks
from covista_service.station.outlook import Prospect, Ratios
from covista_service.station.pairs import Answer


def read(
    prospects: Sequence[Prospect], pairs: NDArray[np.integer], ratios: Sequence[Ratios], computed_ns: Sequence[int]
) -> list[Answer]:
    """The overlaps of pairs (n, 2) of prospects, the smaller id first; by image where keyframes share matches.

    Each comes with the ratios that the scales of the two may have, and with the time that its answer is to be of.
    """
    if not len(pairs):
        return []
    gallery = Gallery.of([Seeing(one.outlook.keyframe.camera, one.surface) for one in prospects])
    both = np.concatenate((pairs, pairs[:, ::-1]))
    forth = np.array(ratios, np.float64)
    said = looks(
        gallery,
        both,
        *relatives([one.pose for one in prospects], both),
        np.concatenate((forth, 1 / forth[:, ::-1])),
        VisibilityOptions(),
    )
    couples = [(prospects[i], prospects[j]) for i, j in pairs.tolist()]
    shared = [_matched(*couple) for couple in couples]
    by_image = [are and one.still and other.still for are, (one, other) in zip(shared, couples, strict=True)]
    sure = intervals(said.shares, said.clues, np.tile(by_image, 2), CertaintyOptions())
    shares, sure = said.shares.reshape(2, -1).T, sure.reshape(2, -1, 2).transpose(1, 0, 2)
    return [
        _answer(*told)
        for told in zip(couples, shares.tolist(), sure.tolist(), shared, by_image, ratios, computed_ns, strict=True)
    ]


def _matched(first: Prospect, second: Prospect) -> bool:
    one, other = first.source, second.source
    return other.keyframe.id in one.matched or one.keyframe.id in other.matched


def _answer(
    couple: tuple[Prospect, Prospect],
    shares: list[float],
    sure: list[list[float]],
    matched: bool,
    by_image: bool,
    ratios: Ratios,
    computed_ns: int,
) -> Answer:
    first, second = couple
    return Answer(
        (shares[0], shares[1]),
        FoundBy.IMAGE if by_image else FoundBy.PREDICTED,
        computed_ns,
        first.outlook.keyframe,
        second.outlook.keyframe,
        ((sure[0][0], sure[0][1]), (sure[1][0], sure[1][1])),
        (first.outlook, second.outlook),
        ratios,
        (first.pose, second.pose),
        (first.time_ns, second.time_ns),
        (first.source.keyframe.id, second.source.keyframe.id),
        matched,
    )

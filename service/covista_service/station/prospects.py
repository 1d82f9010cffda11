"""What two keyframes have in common, by their outlooks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from covista_schemas.reports import FoundBy

from covista_service.perception.camera import relatives
from covista_service.perception.certainty import CertaintyOptions, intervals
from covista_service.perception.visibility import Gallery, Seeing, VisibilityOptions, looks
from covista_service.station.outlooks import Outlook, Ratios
from covista_service.station.pairs import Answer


def read(outlook: Outlook, others: Sequence[tuple[Outlook, Ratios]], now_ns: int) -> list[Answer]:
    """The overlap of an outlook with each of others, the smaller id first; by image where keyframes share matches.

    `others` come with the ratios that their scales may have to the outlook's own.
    """
    if not others:
        return []
    outlooks = [outlook, *(other for other, _ in others)]
    gallery = Gallery.of([Seeing(one.keyframe.camera, one.surface) for one in outlooks])
    beside = np.arange(1, len(outlooks))
    pairs = np.concatenate((np.column_stack((0 * beside, beside)), np.column_stack((beside, 0 * beside))))
    forth = np.array([ratios for _, ratios in others])
    said = looks(
        gallery,
        pairs,
        *relatives([one.pose for one in outlooks], pairs),
        np.concatenate((forth, 1 / forth[:, ::-1])),
        VisibilityOptions(),
    )
    matched = np.array([_matched(outlook, other) for other, _ in others])
    sure = intervals(said.shares, said.clues, np.tile(matched, 2), CertaintyOptions())
    shares, sure = said.shares.reshape(2, -1).T, sure.reshape(2, -1, 2).transpose(1, 0, 2)
    return [
        _answer((outlook, other), shares[k].tolist(), sure[k].tolist(), bool(matched[k]), ratios, now_ns)
        for k, (other, ratios) in enumerate(others)
    ]


def _matched(first: Outlook, second: Outlook) -> bool:
    return second.keyframe.id in first.matched or first.keyframe.id in second.matched


def _answer(
    outlooks: tuple[Outlook, Outlook],
    shares: list[float],
    sure: list[list[float]],
    matched: bool,
    ratios: Ratios,
    now_ns: int,
) -> Answer:
    order = (0, 1) if outlooks[0].keyframe.id.robot < outlooks[1].keyframe.id.robot else (1, 0)
    first, second = outlooks[order[0]], outlooks[order[1]]
    return Answer(
        (shares[order[0]], shares[order[1]]),
        FoundBy.IMAGE if matched else FoundBy.PREDICTED,
        now_ns,
        first.keyframe,
        second.keyframe,
        ((sure[order[0]][0], sure[order[0]][1]), (sure[order[1]][0], sure[order[1]][1])),
        (first, second),
        ratios if order[0] == 0 else (1 / ratios[1], 1 / ratios[0]),
    )

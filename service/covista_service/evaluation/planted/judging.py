"""How good a grouping is, against the groups that were planted."""

from __future__ import annotations

import numpy as np

from covista_service.evaluation.planted.layout import Labels


def adjusted_rand(truth: Labels, found: Labels) -> float:
    """The adjusted Rand index of two labellings (N,): 1 for the same groups, 0 on average for groups by chance.

    Hubert and Arabie, "Comparing partitions", J. Classification 2 (1985). Where chance cannot do otherwise (both all in
    one, or all apart) it is 1.
    """
    _, rows = np.unique(truth, return_inverse=True)
    _, columns = np.unique(found, return_inverse=True)
    table = np.zeros((rows.max(initial=0) + 1, columns.max(initial=0) + 1))
    np.add.at(table, (rows, columns), 1)
    together = _pairs(table).sum()
    in_truth, in_found = _pairs(table.sum(axis=1)).sum(), _pairs(table.sum(axis=0)).sum()
    by_chance = in_truth * in_found / max(float(_pairs(np.array(float(len(truth))))), 1.0)
    most = (in_truth + in_found) / 2
    return float((together - by_chance) / (most - by_chance)) if most != by_chance else 1.0


def _pairs(
    members: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return members * (members - 1) / 2

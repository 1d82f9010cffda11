"""Groups as what hangs together: robots linked by a similarity above a threshold, directly or over others."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from covista_service.grouping.bounds import Bounds, with_least_size
from covista_service.grouping.k_means import Labels, canonical
from covista_service.grouping.similarity import Floats

# A similarity that links two robots. Chosen on planted swarms at alpha = .5, where .55 to .65 are alike.
LINK = 0.6
# Of a cost of no similarity at all, so that no link costs nothing, which csgraph takes for no link.
_DEAREST = 2.0


def components(S: Floats, threshold: float, bounds: Bounds) -> Labels:
    """Labels (N,) of the connected components over similarities (N, N) above a threshold.

    Where bounds on the number of groups demand it, the strongest links below the threshold count too, or the weakest
    above it do not; then groups that are too small join others. Raises ValueError where no grouping satisfies the
    bounds.
    """
    count = len(S)
    if not count:
        return np.zeros(0, np.intp)
    numbers = bounds.numbers(count)
    # Whoever hangs together over links at least that strong does so along the strongest tree.
    tree = minimum_spanning_tree(np.triu(_DEAREST - S, 1)).tocoo()
    # Not by their cost: taking it from the dearest loses a digit, and equals would pass the threshold.
    strength = S[tree.row, tree.col]
    order = np.lexsort((tree.col, tree.row, -strength))
    links = int(np.count_nonzero(strength > threshold))
    links = min(max(links, count - numbers[-1]), count - numbers[0])
    kept = order[:links]
    linked = np.zeros((count, count))
    linked[tree.row[kept], tree.col[kept]] = 1.0
    _, linked_to = connected_components(linked, directed=False)
    return canonical(with_least_size(S, linked_to.astype(np.intp), bounds.min_group_size, bounds.least), count)

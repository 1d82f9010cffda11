"""Ways to group a swarm, by name; a new one joins by its line in `METHODS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from covista_service.evaluation.planted.comparators import components, coslams, distances
from covista_service.evaluation.planted.layout import Labels
from covista_service.evaluation.planted.swarm import Swarm
from covista_service.grouping import similarity
from covista_service.grouping.selection import Criterion, SelectionOptions, choose
from covista_service.grouping.similarity import Floats, Sigma

Method = Callable[[Swarm], Labels]

ALPHA = 0.5


def grouped(swarm: Swarm, criterion: Criterion, sigma: Sigma, alpha: float = ALPHA) -> Labels:
    """Groups by Eqs. 15 and 16 and a criterion: every method of `covista_service.grouping` goes through here."""
    return by_similarity(similarity_of(swarm, sigma, alpha), criterion)


def similarity_of(swarm: Swarm, sigma: Sigma, alpha: float) -> Floats:
    """s_ij of Eq. 16, (N, N)."""
    return similarity.similarity(swarm.overlap, similarity.closeness(distances(swarm), sigma), alpha)


def by_similarity(S: Floats, criterion: Criterion) -> Labels:
    """Groups of a similarity matrix (N, N) with s_ii = 1, their number chosen by a criterion."""
    return choose(S, SelectionOptions("auto", criterion)).labels


METHODS: Mapping[str, Method] = {
    "fiedler": partial(grouped, criterion="fiedler", sigma="std"),
    "paper": partial(grouped, criterion="paper", sigma="std"),
    "distance": partial(grouped, criterion="fiedler", sigma="std", alpha=0.0),
    "components": components,
    "coslam": coslams,
}
# Of swarms that are rendered: groups by numbers of matched features, by the criterion of the first method.
FEATURES_CRITERION: Criterion = "fiedler"

"""Ways to group a swarm, by name; a new one joins by its line in `METHODS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from covista_service.evaluation.planted.comparators import coslams, distances, overlapping
from covista_service.evaluation.planted.layout import Labels
from covista_service.evaluation.planted.swarm import Swarm
from covista_service.grouping import similarity
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.components import LINK, components
from covista_service.grouping.scores import outsider
from covista_service.grouping.selection import Criterion, SelectionOptions, choose
from covista_service.grouping.similarity import Floats, Sigma

Method = Callable[[Swarm], Labels]

ALPHA = 0.5


def grouped(swarm: Swarm, criterion: Criterion, sigma: Sigma, alpha: float = ALPHA) -> Labels:
    """Groups by Eqs. 15 and 16 and a criterion: every method of `covista_service.grouping` goes through here."""
    return by_similarity(similarity_of(swarm, sigma, alpha), criterion, alpha)


def similarity_of(swarm: Swarm, sigma: Sigma, alpha: float) -> Floats:
    """s_ij of Eq. 16, (N, N)."""
    return similarity.matrix(distances(swarm), swarm.overlap, alpha, sigma)


def by_similarity(S: Floats, criterion: Criterion, alpha: float = ALPHA) -> Labels:
    """Groups of a similarity matrix (N, N) with s_ii = 1, their number chosen by a criterion."""
    return choose(S, SelectionOptions(criterion=criterion, stranger=outsider(alpha))).labels


def linked(swarm: Swarm) -> Labels:
    """Connected components over strong similarities, as the station forms them."""
    return components(similarity_of(swarm, "shared", ALPHA), LINK, Bounds())


METHODS: Mapping[str, Method] = {
    "adaptive": partial(grouped, criterion="adaptive", sigma="shared"),
    "silhouette": partial(grouped, criterion="silhouette", sigma="shared"),
    "gain": partial(grouped, criterion="gain", sigma="shared"),
    "eigengap": partial(grouped, criterion="eigengap", sigma="shared"),
    "modularity": partial(grouped, criterion="modularity", sigma="shared"),
    "fiedler_shared": partial(grouped, criterion="fiedler", sigma="shared"),
    "adaptive_std": partial(grouped, criterion="adaptive", sigma="std"),
    "fiedler": partial(grouped, criterion="fiedler", sigma="std"),
    "paper": partial(grouped, criterion="paper", sigma="std"),
    "distance": partial(grouped, criterion="adaptive", sigma="shared", alpha=0.0),
    "components": linked,
    "overlap": overlapping,
    "coslam": coslams,
}
# Of swarms that are rendered: groups by numbers of matched features, by Eq. 17, which asks for no outsider: counts have
# no scale to place one on.
FEATURES_CRITERION: Criterion = "fiedler"

"""What others would group by: simple rules on the same inputs."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from covista_service.evaluation.planted.layout import Labels
from covista_service.evaluation.planted.swarm import Swarm
from covista_service.perception.camera import Floats
from covista_service.perception.comparators import coslam

# Of two robots that share this much of their images, connected components make one group; the best of .3 to .7 on the
# swarms that parameters are chosen on.
LINKED = 0.6


def overlapping(swarm: Swarm) -> Labels:
    """Robots whose overlaps (q_i + q_j)/2 reach `LINKED` belong together, and so do theirs."""
    _, labels = connected_components(coo_array(mutual(swarm) >= LINKED), directed=False)
    return np.asarray(labels, np.intp)


def coslams(swarm: Swarm) -> Labels:
    """CoSLAM's rule: robots that share map points and are not too far apart, and theirs (Zou and Tan 2013).

    That is how its groups part. They merge again over time, which does not pass where a swarm stands still.
    """
    apart = distances(swarm)
    count = len(swarm)
    # The swarm is grouped where it stands, so its initial distances are those that it has.
    mean = float(apart.sum()) / max(count * (count - 1), 1)
    return np.asarray(coslam.groups(swarm.sharing.astype(np.int64), apart, mean), np.intp)


def mutual(swarm: Swarm) -> Floats:
    """(q_i + q_j)/2, (N, N), 0 where unknown: no rule of components has anything else to say of such a pair."""
    both = (swarm.overlap + swarm.overlap.T) / 2
    return np.where(np.isnan(both), 0.0, both)


def distances(swarm: Swarm) -> Floats:
    """|r_i - r_j|, (N, N)."""
    return np.asarray(np.linalg.norm(swarm.positions_m[:, None] - swarm.positions_m, axis=2), np.float64)

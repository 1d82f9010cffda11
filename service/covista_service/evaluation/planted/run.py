"""Plant swarms, group them by every method, and say how well."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from covista_service.evaluation.planted.judging import adjusted_rand
from covista_service.evaluation.planted.layout import Labels
from covista_service.evaluation.planted.methods import FEATURES_CRITERION, METHODS, Method, by_similarity
from covista_service.evaluation.planted.mover import COUNTS, Row, rows
from covista_service.evaluation.planted.rendered import RenderedSwarm, rendered
from covista_service.evaluation.planted.swarm import CLASSES, Disturbance, Swarm, disturbed, plant
from covista_service.evaluation.planted.trial import Trial
from covista_service.grouping.selection import Criterion, SelectionOptions

Tell = Callable[[str], None]

# `measured`: noise, and pairs that nobody has compared. `predicted`: those have what poses and depths predict.
# `biased`: each robot puts a factor of its own on all its overlaps. `harsh`: more of everything.
VARIANTS: Mapping[str, Disturbance] = {
    "measured": Disturbance(),
    "predicted": Disturbance(predicted=True),
    "biased": Disturbance(bias=0.2),
    "harsh": Disturbance(noise=0.1, unknown=0.5, bias=0.3),
}
RENDERED = "rendered"
# Criteria that are compared with a noisy mover, in swarms of so many; Eq. 17 takes its time.
_LIVE: Mapping[Criterion, Sequence[int]] = {"adaptive": COUNTS, "gain": COUNTS, "fiedler": COUNTS[:1]}
# Seeds of the first block, grouped once before anything is timed.
_WARM = 0


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Which swarms: `seeds` of them from `first_seed`, of at most `largest` robots, and `rendered` more from images.

    `drives` is how many movers drive through noisy swarms of each size.
    """

    seeds: int = 216
    first_seed: int = 1000
    largest: int = CLASSES[-1][1]
    rendered: int = 4
    drives: int = 8


def run(options: RunOptions, tell: Tell = lambda _: None) -> Iterator[Trial]:
    """A trial for each swarm, variant and method; `tell` hears of each swarm."""
    small = disturbed(plant(_WARM), Disturbance())
    for method in METHODS.values():
        method(small)  # so that what is compiled on first use is not timed
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        known = plant(seed, options.largest)
        tell(f"seed {seed}: {known.kind}, {len(known.truth)} robots")
        for name, disturbance in VARIANTS.items():
            yield from _trials(name, disturbed(known, disturbance), METHODS)
    for seed in range(options.first_seed, options.first_seed + options.rendered):
        tell(f"rendered seed {seed}")
        seen = rendered(seed)
        yield from _trials(RENDERED, seen.swarm, methods_of(seen))


def moving(options: RunOptions, tell: Tell = lambda _: None) -> list[Row]:
    """How still groups stand while a robot drives from one to another, by the criteria that may run live."""
    found: list[Row] = []
    for criterion, counts in _LIVE.items() if options.drives else ():
        tell(f"noisy movers: {criterion}")
        found += rows(SelectionOptions(criterion=criterion), counts, options.drives, seed=options.first_seed)
    return found


def methods_of(seen: RenderedSwarm) -> dict[str, Method]:
    """Every method for a rendered swarm, and one by numbers of features."""
    return {
        **METHODS,
        "features": lambda _: by_similarity(seen.features, FEATURES_CRITERION),
    }


def _trials(variant: str, swarm: Swarm, methods: Mapping[str, Method]) -> Iterator[Trial]:
    for name, method in methods.items():
        start = time.perf_counter_ns()
        labels = method(swarm)
        ms = (time.perf_counter_ns() - start) / 1e6
        ari = adjusted_rand(swarm.truth, labels)
        counts = (_groups(labels), _groups(swarm.truth))
        yield Trial(variant, name, swarm.kind, swarm.seed, len(swarm), *counts, ari, ms)


def _groups(labels: Labels) -> int:
    return len(set(labels.tolist()))

"""The groups that the settings propose for the similarity as it is now, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from covista_service.grouping import selection
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.components import LINK, components
from covista_service.grouping.hysteresis import held
from covista_service.grouping.k_means import Labels
from covista_service.grouping.scores import Contributions, outsider
from covista_service.grouping.selection import SelectionOptions
from covista_service.grouping.similarity import Floats
from covista_service.station.options import GroupingOptions


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Labels (N,) in the order of the robots, the score of every number of groups, and a note if any.

    `contributions` tell what each robot adds to the score of any grouping; `bounds` are those in force.
    """

    labels: Labels
    scores: tuple[tuple[int, float], ...]
    note: str | None
    contributions: Contributions
    bounds: Bounds


def propose(
    S: Floats, similarity: Callable[[float], Floats], options: GroupingOptions, shown: Labels | None = None
) -> Proposal:
    """Group robots by their similarity S (N, N); `similarity` tells what it is with another alpha.

    Bounds that so many robots cannot keep are loosened, and the note says so. `shown` (N,) are the groups on show, to
    hold on to.
    """
    count = len(S)
    alpha = options.alpha
    if options.grouping == "distance":
        alpha = 0.0
        S = similarity(alpha)
    if shown is not None:
        S = held(S, shown, options.hysteresis.gain)
    asked = Bounds(options.groups, options.min_group_size)
    refusal = asked.refusal(count) if count else None
    bounds = asked if refusal is None else asked.loosened(count)
    chosen_by = SelectionOptions(bounds.groups, options.criterion, bounds.min_group_size, outsider(alpha))
    note = refusal or _note(options, count)
    if options.grouping == "components":
        chosen_by = replace(chosen_by, criterion="silhouette")
        contributions = selection.contributions(S, chosen_by)
        labels = components(S, LINK, bounds)
        scores = ((int(labels.max()) + 1, float(contributions(labels).sum())),) if count else ()
        return Proposal(labels, scores, note, contributions, bounds)
    choice = selection.choose(S, chosen_by, shown)
    return Proposal(choice.labels, choice.scores, note, selection.contributions(S, chosen_by), bounds)


def _note(options: GroupingOptions, count: int) -> str | None:
    if options.grouping != "components" and options.criterion == "paper" and count > selection.PAPER_UP_TO:
        return f"criterion paper is not meant for more than {selection.PAPER_UP_TO} robots, and these are {count}"
    return None

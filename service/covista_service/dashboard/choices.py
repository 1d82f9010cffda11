"""The live settings as one may try them: each with a sentence of what it does, and the bounds of its schema."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from covista_schemas.settings import LiveSettings

Kind = Literal["number", "count", "groups", "sigma", "choice"]
# A slider reaches so far; what lies beyond can be typed.
_FAR_S, _FAR_M = 60.0, 50.0


@dataclass(frozen=True, slots=True)
class Choice:
    """One setting: `name` as in a patch, parts of the hysteresis after a dot.

    `far` is where its slider ends; `shown` is whether a preview shows what it does.
    """

    name: str
    label: str
    says: str
    kind: Kind
    step: float = 0.01
    far: float | None = None
    unit: str = ""
    options: tuple[tuple[str, str], ...] = ()
    shown: bool = True


SIGMAS = (
    ("shared", "Near is how far robots stand apart that see the same."),
    ("std", "The spread of all distances, as in the paper: too large beyond some 30 robots."),
    ("metres", "Near is what you say."),
)
GROUPS = (
    ("auto", "The station finds the number."),
    ("number", "So many, no matter what."),
    ("range", "The station finds the number between two."),
)
CRITERIA = (
    ("adaptive", "Small groups first, merged two by two while it gets better: good for every size of swarm."),
    ("silhouette", "Every number is tried; the groups that lie closest within and farthest apart win."),
    ("gain", "Each robot goes where it gains most. Fast, and may split a swarm that is one."),
    ("fiedler", "The paper's score, a single group admitted. For small swarms."),
    ("paper", "The paper's score as printed: two groups at least, 30 robots at most."),
    ("eigengap", "Where the eigenvalues fall most. Often too few groups."),
    ("modularity", "As for networks of friends. Seldom leaves a robot alone."),
)
GROUPINGS = (
    ("spectral", "What is seen in common and distance together."),
    ("components", "Whoever hangs together by strong similarity; the criterion plays no part."),
    ("distance", "Distance alone; what robots see plays no part."),
)
SECTIONS: tuple[tuple[str, tuple[Choice, ...]], ...] = (
    (
        "What makes robots alike",
        (
            Choice(
                "alpha",
                "Views against places",
                "To the left places decide, to the right what is seen.",
                "number",
                far=1,
            ),
            Choice(
                "sigma", "How near is near", "Up to which distance places count.", "sigma", 0.1, _FAR_M, "m", SIGMAS
            ),
            Choice("grouping", "Groups by", "What groups are made from.", "choice", options=GROUPINGS),
        ),
    ),
    (
        "How many groups",
        (
            Choice("groups", "Number of groups", "How many groups there are.", "groups", 1, options=GROUPS),
            Choice("min_group_size", "Smallest group", "How many robots a group has at least.", "count", 1),
            Choice("criterion", "Criterion", "How the number of groups is found.", "choice", options=CRITERIA),
        ),
    ),
    (
        "How steady groups are",
        (
            Choice(
                "hysteresis.gain",
                "Hold on",
                "More: other groups must be better by more before they are shown.",
                "number",
                far=0.9,
                shown=False,
            ),
            Choice(
                "hysteresis.persistence_s",
                "Wait",
                "A change that is not clear is shown when it has lasted so long; a clear one at once.",
                "number",
                0.5,
                _FAR_S,
                "s",
                shown=False,
            ),
            Choice(
                "hysteresis.smoothing",
                "Weight of the newest view",
                "Less: one odd picture changes less, and true changes come later. 1: no smoothing.",
                "number",
                far=1,
                shown=False,
            ),
        ),
    ),
)


def sections() -> list[dict[str, Any]]:
    """All of them under headings, with `least`, `most` and `default`; `above` where `least` itself is too little."""
    schemas = dict(_schemas())
    return [
        {"title": title, "settings": [_told(each, schemas[each.name]) for each in some]} for title, some in SECTIONS
    ]


def _told(choice: Choice, schema: Mapping[str, Any]) -> dict[str, Any]:
    numbers = [each for each in schema.get("anyOf", [schema]) if each.get("type") in ("number", "integer")]
    bounds = numbers[0] if numbers else {}
    above = bounds.get("exclusiveMinimum")
    return {
        **asdict(choice),
        "options": [{"value": value, "says": says} for value, says in choice.options],
        "least": bounds.get("minimum", above),
        "above": above is not None,
        "most": bounds.get("maximum"),
        "default": schema.get("default"),
    }


def _schemas() -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The schema of each setting, parts of the hysteresis by themselves."""
    schema = LiveSettings.model_json_schema()
    for name, each in schema["properties"].items():
        if name != "hysteresis":
            yield name, each
    for part, each in schema["$defs"]["Hysteresis"]["properties"].items():
        yield f"hysteresis.{part}", each

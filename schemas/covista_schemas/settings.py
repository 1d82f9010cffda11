"""The settings that can change while the station runs, and patches of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from covista_schemas.report import Report

# No swarm has as many; numbers beyond are slips of the finger.
MOST_GROUPS = 1_000_000


class _Bounds(Report):
    model_config = ConfigDict(frozen=True, extra="forbid")

    min: int = Field(ge=1, le=MOST_GROUPS)
    max: int = Field(ge=1, le=MOST_GROUPS)


class GroupBounds(_Bounds):
    """Least and largest number of groups to consider."""

    @model_validator(mode="after")
    def _order(self) -> Self:
        if self.min > self.max:
            raise ValueError("min must not be larger than max")
        return self


class Hysteresis(Report):
    """When groups on show change, and how overlaps are smoothed: so that what flickers does not make groups flicker."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    gain: float = Field(
        default=0.05,
        ge=0,
        le=0.9,
        description="Share of the groups on show in the similarity that groups are made from: others must gain more.",
    )
    persistence_s: float = Field(
        default=5.0,
        ge=0,
        le=3600,
        description="A change without a clear gain is shown when it has been proposed for so long.",
    )
    smoothing: float = Field(
        default=0.3, gt=0, le=1, description="Weight of a pair's newest overlap in the similarity; 1: no smoothing."
    )


class LiveSettings(Report):
    """The settings that can change while the station runs."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    alpha: float = Field(default=0.5, ge=0, le=1, description="Weight of the overlap against closeness, Eq. 16.")
    groups: Literal["auto"] | Annotated[int, Field(ge=1, le=MOST_GROUPS)] | GroupBounds = Field(
        default="auto", description="auto, a number of groups, or bounds on it: {min, max}, both, 1 <= min <= max."
    )
    min_group_size: int = Field(default=1, ge=1, le=MOST_GROUPS, description="How many robots a group has at least.")
    sigma: Literal["shared", "std"] | Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)] = Field(
        default="shared",
        description="Range of Eq. 15: shared (by the distances of robots that see the same), "
        "std (standard deviation of all distances, as in the paper), or metres.",
    )
    criterion: Literal["adaptive", "silhouette", "gain", "fiedler", "paper", "eigengap", "modularity"] = Field(
        default="adaptive",
        description="How the number of groups is chosen; paper is Eq. 17 as printed, for 30 robots at most.",
    )
    grouping: Literal["spectral", "components", "distance"] = Field(
        default="spectral",
        description="What groups are made from: spectral (the similarity), components (robots linked by similarities "
        "above a threshold), distance (closeness alone).",
    )
    hysteresis: Hysteresis = Field(default=Hysteresis(), description="How steady groups on show are.")


# A patch part by part: the name of a setting, or of a part of one after a dot, as in hysteresis.gain.
Patch = Mapping[str, Any]
_PARTED = "hysteresis"


def _without_defaults(schema: JsonDict) -> None:
    """In a patch, what is left out stays as it is: defaults would say otherwise."""
    properties = schema.get("properties")
    for each in properties.values() if isinstance(properties, dict) else ():
        if isinstance(each, dict):
            each.pop("default", None)


def _whole(value: object) -> object:
    """JSON has one kind of numbers: 3.0 is a whole one."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


_Count = Annotated[int, Field(ge=1, le=MOST_GROUPS), BeforeValidator(_whole)]


class GroupBoundsPatch(_Bounds):
    """Least and largest number of groups to consider, both; that they are in order is for `patched` to see."""

    model_config = ConfigDict(strict=True)

    min: _Count
    max: _Count


class HysteresisPatch(Hysteresis):
    """Parts of the hysteresis; what is left out stays as it is."""

    model_config = ConfigDict(strict=True, json_schema_extra=_without_defaults)


class SettingsPatch(LiveSettings):
    """Live settings that are to change; what is left out stays as it is, and null is no value."""

    model_config = ConfigDict(strict=True, json_schema_extra=_without_defaults)

    groups: Literal["auto"] | _Count | GroupBoundsPatch = Field(  # type: ignore[assignment]  # looser
        default="auto", description="auto, a number of groups, or bounds on it: {min, max}, both, 1 <= min <= max."
    )
    min_group_size: _Count = Field(default=1, description="How many robots a group has at least.")
    hysteresis: HysteresisPatch = Field(default=HysteresisPatch(), description="How steady groups on show are.")


def flat(patch: SettingsPatch) -> Patch:
    """What a patch names, part by part, as JSON has it: so that later patches can be laid over it."""
    return dict(parts_of(patch.model_dump(mode="json", exclude_unset=True)))


def patched(live: LiveSettings, patch: Patch) -> LiveSettings:
    """The settings with a flat patch laid over them. Raises ValidationError for what makes no sense."""
    values = live.model_dump()
    for name, value in patch.items():
        whole, dot, part = name.partition(".")
        if dot and whole == _PARTED:
            values[whole] = {**values[whole], part: value}
        else:
            values[name] = value
    return LiveSettings.model_validate(values)


def parts_of(values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Settings by name, parts of the hysteresis by themselves."""
    for name, value in values.items():
        if name == _PARTED:
            yield from ((f"{name}.{part}", each) for part, each in value.items())
        else:
            yield name, value

"""The live settings: as reports, as options of the station, and what a patch makes of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from covista_schemas.reports import GroupBounds, Hysteresis, LiveSettings, SettingsPatch

from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.station.options import GroupingOptions

# The name of a setting, or of a part of one after a dot: hysteresis.gain.
Patch = Mapping[str, Any]
_PARTED = "hysteresis"


def live_settings(options: GroupingOptions) -> LiveSettings:
    """The station's options as settings."""
    groups = options.groups
    return LiveSettings(
        alpha=options.alpha,
        groups=GroupBounds(min=groups[0], max=groups[1]) if isinstance(groups, tuple) else groups,
        min_group_size=options.min_group_size,
        sigma=options.sigma,
        criterion=options.criterion,
        grouping=options.grouping,
        hysteresis=Hysteresis(
            gain=options.hysteresis.gain,
            persistence_s=options.hysteresis.persistence_s,
            smoothing=options.smoothing,
        ),
    )


def grouping_options(live: LiveSettings) -> GroupingOptions:
    """Settings as the station's options."""
    groups = live.groups
    bounds = (groups.min, groups.max) if isinstance(groups, GroupBounds) else groups
    return GroupingOptions(
        alpha=live.alpha,
        groups=bounds,
        min_group_size=live.min_group_size,
        sigma=live.sigma,
        criterion=live.criterion,
        grouping=live.grouping,
        hysteresis=HysteresisOptions(live.hysteresis.gain, live.hysteresis.persistence_s),
        smoothing=live.hysteresis.smoothing,
    )


def flat(patch: SettingsPatch) -> Patch:
    """What a patch names, part by part, as JSON has it: so that later patches can be laid over it."""
    return dict(_parts(patch.model_dump(mode="json", exclude_unset=True)))


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


def changes(before: LiveSettings, after: LiveSettings) -> str:
    """What is different, in words."""
    old, new = (dict(_parts(each.model_dump(mode="json"))) for each in (before, after))
    differing = [f"{name} is {_word(new[name])}, was {_word(old[name])}" for name in new if new[name] != old[name]]
    return "; ".join(differing) or "nothing changes"


def _parts(values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if name == _PARTED:
            yield from ((f"{name}.{part}", each) for part, each in value.items())
        else:
            yield name, value


def _word(value: object) -> str:
    return f"{value['min']} to {value['max']}" if isinstance(value, dict) else f"{value}"

"""The live settings: as reports, as options of the station, and what is different between two."""

from __future__ import annotations

from covista_schemas.settings import GroupBounds, Hysteresis, LiveSettings, parts_of

from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.station.options import GroupingOptions


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


def changes(before: LiveSettings, after: LiveSettings) -> str:
    """What is different, in words."""
    old, new = (dict(parts_of(each.model_dump(mode="json"))) for each in (before, after))
    differing = [f"{name} is {_word(new[name])}, was {_word(old[name])}" for name in new if new[name] != old[name]]
    return "; ".join(differing) or "nothing changes"


def _word(value: object) -> str:
    return f"{value['min']} to {value['max']}" if isinstance(value, dict) else f"{value}"

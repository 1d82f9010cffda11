from typing import Any, get_args

import pytest
from covista_schemas.settings import LiveSettings, SettingsPatch, flat, parts_of
from covista_service.dashboard.choices import sections
from pydantic import ValidationError


@pytest.fixture(scope="module")
def told() -> dict[str, dict[str, Any]]:
    return {each["name"]: each for section in sections() for each in section["settings"]}


def patch_of(name: str, value: object) -> dict[str, Any]:
    whole, dot, part = name.partition(".")
    return {whole: {part: value} if dot else value}


def test_every_live_setting_can_be_tried_and_says_what_it_does(told: dict[str, dict[str, Any]]) -> None:
    assert told.keys() == dict(parts_of(LiveSettings().model_dump())).keys()
    assert all(each["says"].endswith(".") and each["label"] for each in told.values())


def test_defaults_are_those_of_the_station(told: dict[str, dict[str, Any]]) -> None:
    assert {name: each["default"] for name, each in told.items()} == dict(parts_of(LiveSettings().model_dump()))


@pytest.mark.parametrize("name", ["criterion", "grouping"])
def test_words_are_offered_all_and_each_is_explained(name: str, told: dict[str, dict[str, Any]]) -> None:
    offered = told[name]["options"]
    assert [each["value"] for each in offered] == list(get_args(LiveSettings.model_fields[name].annotation))
    assert all(each["says"] for each in offered)


@pytest.mark.parametrize(
    ("name", "far_too_much"),
    [("alpha", 1.01), ("min_group_size", 10**7), ("groups", 10**7), ("sigma", 1e10), ("hysteresis.gain", 0.91)],
)
def test_bounds_are_those_that_a_patch_has(name: str, far_too_much: float, told: dict[str, dict[str, Any]]) -> None:
    most = told[name]["most"]
    assert flat(SettingsPatch.model_validate(patch_of(name, most))) == {name: most}
    with pytest.raises(ValidationError):
        SettingsPatch.model_validate(patch_of(name, far_too_much))


@pytest.mark.parametrize("name", ["sigma", "hysteresis.smoothing"])
def test_what_must_be_more_than_its_bound_says_so(name: str, told: dict[str, dict[str, Any]]) -> None:
    assert told[name]["above"]
    with pytest.raises(ValidationError):
        SettingsPatch.model_validate(patch_of(name, float(told[name]["least"])))


def test_what_acts_over_time_is_told_as_such(told: dict[str, dict[str, Any]]) -> None:
    assert {name for name, each in told.items() if not each["shown"]} == {
        "hysteresis.gain",
        "hysteresis.persistence_s",
        "hysteresis.smoothing",
    }

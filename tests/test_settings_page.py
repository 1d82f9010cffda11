"""The table of the settings in docs/operations.md is the one that `covista-station settings` writes."""

import json
import subprocess
import sys
from pathlib import Path

from covista_schemas.reports import LiveSettings
from covista_service.config import Settings
from covista_service.settings_command import every, markdown

PAGE = Path(__file__).parents[1] / "docs" / "operations.md"


def test_the_page_has_the_table_as_it_is_now() -> None:
    assert "\n".join(markdown(list(every()))) in PAGE.read_text("utf-8")


def test_every_setting_is_listed_once_and_described() -> None:
    listed = [each.name.partition(".")[0] for each in every()]
    assert set(listed) == set(Settings.model_fields)
    whole = [name for name in listed if name != "hysteresis"]
    assert len(whole) == len(set(whole))
    assert all(each.description and each.allowed for each in every())
    assert listed[-1] in LiveSettings.model_fields


def test_variables_are_those_that_are_read() -> None:
    assert {each.name: each.variable for each in every()}["hysteresis.gain"] == "COVISTA_HYSTERESIS__GAIN"
    assert all(each.variable.startswith("COVISTA_") for each in every())


def test_the_command_writes_it_for_programs_too() -> None:
    command = [sys.executable, "-m", "covista_service", "settings", "--format", "json"]
    listed = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    assert [each["name"] for each in listed] == [each.name for each in every()]

"""The scripts that draw groups have as many colours as labels count on."""

import re
from pathlib import Path

import covista_service.dashboard
import pytest
from covista_service.grouping.continuity import COLOURS

WEB = Path(covista_service.dashboard.__file__).parent / "web"


@pytest.mark.parametrize("palette", ["LIGHT", "DARK"])
def test_each_palette_has_a_colour_for_each_number_that_labels_tell_apart(palette: str) -> None:
    script = (WEB / "lib" / "looks.js").read_text()
    (colours,) = re.findall(rf"const {palette} = \[(.*?)\];", script)
    assert len(set(re.findall("#[0-9a-f]{6}", colours))) == COLOURS

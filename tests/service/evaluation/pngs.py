"""Pictures on disk, read back."""

from __future__ import annotations

from pathlib import Path

import cv2


def size_of(path: Path) -> tuple[int, int]:
    """Width and height of a PNG."""
    picture = cv2.imread(str(path))
    assert picture is not None, path
    return picture.shape[1], picture.shape[0]

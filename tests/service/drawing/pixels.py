"""What is drawn, pixel by pixel."""

import cv2
import numpy as np
from numpy.typing import NDArray


def drawn(data: bytes) -> NDArray[np.uint8]:
    """The picture (h, w, 3), BGR, of a PNG file's bytes."""
    assert data.startswith(b"\x89PNG")
    found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert found is not None
    return np.asarray(found, np.uint8)


def pixels_of(picture: NDArray[np.uint8], colour: str) -> int:
    """How many pixels have this colour (#rrggbb), nearly."""
    rgb = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return int((np.abs(picture[..., ::-1].astype(int) - rgb).max(axis=2) < 12).sum())

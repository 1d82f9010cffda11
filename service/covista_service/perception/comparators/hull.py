"""The share of either image that the convex hull of its matched features covers: the obvious measure of an overlap.

It is biased. Too low: of n points spread evenly over a quadrangle the hull leaves out about (8/3) ln n / n (Rényi and
Sulanke 1963), that is 12 % of 100 points, and all that carries no features or does not match. Too high: it covers what
lies between the points, whether both see it or not. And one wrong match at the border blows it up.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.perception.comparators.image import Image
from covista_service.perception.comparators.snavely import SnavelyOptions, verified
from covista_service.perception.matching import MatchingOptions

# Lowe's own ratio: the more matches, the less the hull leaves out.
DEFAULTS = SnavelyOptions(matching=MatchingOptions(0.8, 0.8))


def overlap(first: Image, second: Image, options: SnavelyOptions = DEFAULTS) -> tuple[float, float, int]:
    """Shares of the first and the second image, from 0 to 1, and the number of matches behind them."""
    inliers = verified(first, second, options)
    return _covered(first, inliers[:, 0]), _covered(second, inliers[:, 1]), len(inliers)


def _covered(image: Image, chosen: NDArray[np.intp]) -> float:
    if len(chosen) < 3:
        return 0.0
    area = cv2.contourArea(cv2.convexHull(image.features.keypoints_px[chosen]))
    return min(1.0, area / (image.width * image.height))

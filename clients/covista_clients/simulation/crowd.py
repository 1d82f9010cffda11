"""A crowd: up to thousands of robots that send ready-made keyframes, at the same density however many they are.

A *tile* is the world of a stock with its robots. Tiles lie side by side, moved and not turned, so that each looks like
the next one: images of different places would be the same, and a station would find that robots see in common what
they do not. So every tile has its own order of the descriptors' 128 dimensions. Distances between descriptors of one
tile are what they were, to the bit; across tiles nothing matches. What a station has to do is the same as in a large
world of which no part is like another, but for two things: nobody sees across from one tile into the next one, and all
tiles have the same shapes.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from covista_schemas import codec
from covista_schemas.messages import Features, Pose
from numpy.typing import NDArray

from covista_clients.simulation.stock import Shot, Stock
from covista_clients.simulation.world import Floats

# Between tiles. A station that does not know of walls takes views to reach three times as deep as what it has seen:
# with less, robots of large crowds, which have tiles on all sides, would have more plausible neighbours than those of
# small ones, and no two sizes could be compared.
GAP_M = 48.0


class Crowd:
    """`robots` robots with the keyframes of a stock: who is where, and what it sees. No clock and no link.

    `step` counts keyframes of a robot from 0 on, and may lie between two; robots go to the end of their stock, the same
    way back, and so on. Tiles are filled court by court, and the last one as far as there are robots.
    """

    def __init__(self, stock: Stock, robots: int, seed: int = 0, prefix: str = "r") -> None:
        """Names are the prefix and a number from 1 on. Raises ValueError without robots."""
        if robots < 1:
            raise ValueError(f"a crowd has at least 1 robot, not {robots}")
        self.robots = robots
        self.names = tuple(f"{prefix}{robot + 1}" for robot in range(robots))
        self._stock = stock
        tiles = -(-robots // stock.robots)
        self._offsets_m = _laid_out(tiles, stock.upper_m - stock.lower_m + GAP_M)
        self._orders = _orders(tiles, stock, seed)

    def offset_m(self, robot: int) -> tuple[float, float]:
        """How far the tile of a robot is moved from where its stock was made."""
        return self._offsets_m[robot // self._stock.robots]

    def pose(self, robot: int, step: float, time_ns: int = 0) -> Pose:
        """Camera pose of a robot."""
        (x, y, z), orientation = self._stock.placed(robot % self._stock.robots, self._folded(step))
        east_m, north_m = self.offset_m(robot)
        return Pose((x + east_m, y + north_m, z), orientation, time_ns)

    def features(self, robot: int, step: int) -> Features:
        """Features of a robot's keyframe."""
        found = self._shot(robot, step).features
        order = self._orders[robot // self._stock.robots]
        # Rows are moved as they are, columns byte by byte: there and back is three times as fast.
        moved = cv2.transpose(cv2.transpose(found.descriptors)[order])
        return Features(found.kind, found.keypoints_px, np.asarray(moved, np.uint8))

    def picture(self, robot: int, step: int) -> bytes:
        """Camera, features and thumbnail of a keyframe, for `codec.encode_taken`."""
        thumbnail = self._shot(robot, step).thumbnail
        return codec.encode_picture(self._stock.camera, self.features(robot, step), thumbnail)

    def _shot(self, robot: int, step: int) -> Shot:
        return self._stock.shots[robot % self._stock.robots][int(self._folded(step))]

    def _folded(self, step: float) -> float:
        """Where in the stock a robot is that goes there and back."""
        last = self._stock.steps - 1
        gone = step % (2 * last) if last else 0
        return min(gone, 2 * last - gone)


def _laid_out(tiles: int, pitch_m: Floats) -> list[tuple[float, float]]:
    """Offsets in rows that make a square, or nearly."""
    columns = math.isqrt(tiles - 1) + 1
    width_m, depth_m = pitch_m.tolist()
    return [(tile % columns * width_m, tile // columns * depth_m) for tile in range(tiles)]


def _orders(tiles: int, stock: Stock, seed: int) -> list[NDArray[np.intp]]:
    """A permutation of the dimensions for each tile; the first tile's are as they were made."""
    rng = np.random.default_rng([seed, tiles])
    width = stock.shots[0][0].features.descriptors.shape[1]
    return [np.arange(width), *(rng.permutation(width) for _ in range(tiles - 1))]

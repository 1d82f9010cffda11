"""A rover on the base install: sends one keyframe of features to the router named, and says what it took to do so."""

import importlib.metadata
import json
import sys

import numpy as np
from covista_clients import Camera, Features, Pose, Rover

random = np.random.default_rng(0)
features = Features.from_arrays("orb", random.uniform(0, 200, (50, 2)), random.integers(0, 256, (50, 32), np.uint8))
camera = Camera(fx=300, fy=300, cx=159.5, cy=119.5, width=320, height=240)
with Rover("r1", camera, connect=sys.argv[1], send="features") as rover:
    rover.send_keyframe(features, Pose(position_m=(1.0, 2.0, 3.0)))

installed = {distribution.name for distribution in importlib.metadata.distributions()}
sys.stdout.write(json.dumps({"modules": sorted(sys.modules), "installed": sorted(installed)}))

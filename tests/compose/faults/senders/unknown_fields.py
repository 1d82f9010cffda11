"""Robot u1 speaks a later patch version: its messages bear fields that nobody here knows; prints what it has sent."""

import json
import sys
import time

import numpy as np
import zenoh
from covista_schemas import codec, features, keys
from covista_schemas.messages import Camera, Keyframe, Pose, PoseUpdate
from covista_schemas.zenoh_config import config

# Field 1000, a text, and field 1001, a number.
UNKNOWN = b"\xc2\x3e\x05later" + b"\xc8\x3e\x2a"
SENT = 10
camera = Camera(fx=300, fy=300, cx=160, cy=120, width=320, height=240)
picture = np.kron(np.random.default_rng(0).integers(0, 255, (24, 32)), np.ones((10, 10))).astype(np.uint8)
data = features.encode_jpeg(picture, 85)
block = zenoh.CongestionControl.BLOCK
with zenoh.open(config("client", connect=[sys.argv[1]])) as session:
    for number in range(SENT):
        pose = Pose((0.01 * number, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), time.time_ns())
        keyframe = codec.encode_keyframe(Keyframe("u1", "later", number, camera, pose, data)) + UNKNOWN
        session.put(keys.keyframe("default", "u1"), keyframe, congestion_control=block)
        update = codec.encode_pose(PoseUpdate("u1", "later", number, pose)) + UNKNOWN
        session.put(keys.pose("default", "u1"), update, congestion_control=block)
        # Each is to be opened: what comes closer together gives way to the newest.
        time.sleep(0.2)
sys.stdout.write(json.dumps({"robot": "u1", "keyframes": SENT, "poses": SENT}))

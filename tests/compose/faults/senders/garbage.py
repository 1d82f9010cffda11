"""Robot g1 says where it is, and then sends what nobody can read, as fast as it can; prints what it has sent."""

import json
import os
import sys
import time

import zenoh
from covista_schemas import codec, keys
from covista_schemas.messages import Pose, PoseUpdate
from covista_schemas.zenoh_config import config

seconds, endpoint = float(sys.argv[1]), sys.argv[2]
# The first bytes say: a field of a length that does not come.
junk = [b"\x0a\xff\xff\xff\x7f" + os.urandom(size) for size in (11, 200, 4000)]
sent = 0
with zenoh.open(config("client", connect=[endpoint])) as session:
    update = PoseUpdate("g1", "junk", 0, Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), time.time_ns()))
    block = zenoh.CongestionControl.BLOCK
    session.put(keys.pose("default", "g1"), codec.encode_pose(update), congestion_control=block)
    ends = time.monotonic() + seconds
    while time.monotonic() < ends:
        session.put(keys.keyframe("default", "g1"), junk[sent % 3], congestion_control=block)
        sent += 1
sys.stdout.write(json.dumps({"robot": "g1", "garbage": sent, "poses": 1}))

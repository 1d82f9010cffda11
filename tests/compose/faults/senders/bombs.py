"""Robot b1 sends pictures that would fill the memory of whoever unpacks them; prints how many."""

import json
import struct
import sys
import time
import zlib

import zenoh
from covista_schemas import codec, keys
from covista_schemas.messages import Camera, Keyframe, Pose
from covista_schemas.zenoh_config import config


def png(width: int, height: int, rows: int) -> bytes:
    """A grey picture of nothing that claims a size, and has so many rows."""
    squeezed = zlib.compress(bytes((width + 1) * rows), 9)
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)), (b"IDAT", squeezed), (b"IEND", b""))
    body = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body


# The head alone claims 1.6 gigapixels; the other unpacks to far more than the picture that it says it is.
BOMBS = {"image_too_large": png(40_000, 40_000, 1000), "bad_image": png(3000, 20, 100)}
sent = dict.fromkeys(BOMBS, 0)
with zenoh.open(config("client", connect=[sys.argv[1]])) as session:
    for number in range(20):
        name = list(BOMBS)[number % 2]
        side = 40_000 if name == "image_too_large" else 640
        camera = Camera(fx=500, fy=500, cx=320, cy=240, width=side, height=side)
        pose = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), time.time_ns())
        data = codec.encode_keyframe(Keyframe("b1", "bomb", number, camera, pose, BOMBS[name]))
        session.put(keys.keyframe("default", "b1"), data, congestion_control=zenoh.CongestionControl.BLOCK)
        sent[name] += 1
        # Each is to be opened: what comes closer together gives way to the newest.
        time.sleep(0.15)
sys.stdout.write(json.dumps({"robot": "b1", "keyframes": sum(sent.values())}))

"""Anything that a robot may rightly say, for tests that hold for all of it."""

import numpy as np
from covista_schemas.messages import (
    DESCRIPTOR_BYTES,
    Camera,
    Distortion,
    FeatureKind,
    Features,
    Keyframe,
    Pose,
    PoseUpdate,
)
from hypothesis import strategies as st

ids = st.from_regex(r"[a-z0-9][a-z0-9_-]{0,62}", fullmatch=True)
sequences = st.integers(0, 2**63 - 1)
numbers = st.floats(-1e6, 1e6)
coordinates = st.floats(-1e12, 1e12)
times_ns = st.integers(-(2**63), 2**63 - 1)
distortions = st.one_of(
    st.just(Distortion()),
    st.lists(numbers, min_size=4, max_size=5).map(lambda k: Distortion(model="plumb_bob", coefficients=tuple(k))),
    st.lists(numbers, min_size=4, max_size=4).map(lambda k: Distortion(model="equidistant", coefficients=tuple(k))),
)
cameras = st.builds(
    Camera,
    fx=st.floats(0.1, 1e6),
    fy=st.floats(0.1, 1e6),
    cx=numbers,
    cy=numbers,
    width=st.integers(1, 65_535),
    height=st.integers(1, 65_535),
    distortion=distortions,
)


@st.composite
def quaternions(draw: st.DrawFn) -> tuple[float, float, float, float]:
    """Unit quaternions, all rotations alike."""
    raw = np.random.default_rng(draw(st.integers(0, 2**32))).normal(size=4)
    x, y, z, w = (raw / np.linalg.norm(raw)).tolist()
    return x, y, z, w


poses = st.builds(
    Pose,
    position_m=st.tuples(coordinates, coordinates, coordinates),
    orientation_xyzw=quaternions(),
    time_ns=times_ns,
    covariance=st.one_of(st.just(()), st.tuples(*[numbers] * 36)),
)


@st.composite
def features_of(draw: st.DrawFn, camera: Camera) -> Features:
    """Features inside of the camera's image."""
    kind = draw(st.sampled_from(FeatureKind))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(0, 20))
    points = rng.uniform((-0.5, -0.5), (camera.width - 0.6, camera.height - 0.6), (n, 2))
    return Features.from_arrays(kind, points, rng.integers(0, 256, (n, DESCRIPTOR_BYTES[kind]), np.uint8))


@st.composite
def keyframes(draw: st.DrawFn) -> Keyframe:
    """Keyframes with an image, or with features and perhaps a thumbnail."""
    camera = draw(cameras)
    name = draw(ids), draw(ids), draw(sequences)
    if draw(st.booleans()):
        return Keyframe(*name, camera, draw(poses), image=draw(st.binary(min_size=1, max_size=100)))
    thumbnail = draw(st.none() | st.binary(min_size=1, max_size=100))
    return Keyframe(*name, camera, draw(poses), features=draw(features_of(camera)), thumbnail=thumbnail)


pose_updates = st.builds(PoseUpdate, robot=ids, boot=ids, sequence=sequences, pose=poses)

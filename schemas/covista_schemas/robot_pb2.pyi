from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Distortion(_message.Message):
    __slots__ = ("model", "coefficients")
    MODEL_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENTS_FIELD_NUMBER: _ClassVar[int]
    model: str
    coefficients: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, model: _Optional[str] = ..., coefficients: _Optional[_Iterable[float]] = ...) -> None: ...

class Camera(_message.Message):
    __slots__ = ("fx", "fy", "cx", "cy", "width", "height", "distortion")
    FX_FIELD_NUMBER: _ClassVar[int]
    FY_FIELD_NUMBER: _ClassVar[int]
    CX_FIELD_NUMBER: _ClassVar[int]
    CY_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    DISTORTION_FIELD_NUMBER: _ClassVar[int]
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: Distortion
    def __init__(self, fx: _Optional[float] = ..., fy: _Optional[float] = ..., cx: _Optional[float] = ..., cy: _Optional[float] = ..., width: _Optional[int] = ..., height: _Optional[int] = ..., distortion: _Optional[_Union[Distortion, _Mapping]] = ...) -> None: ...

class Transform(_message.Message):
    __slots__ = ("position_m", "orientation_xyzw")
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    position_m: _containers.RepeatedScalarFieldContainer[float]
    orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, position_m: _Optional[_Iterable[float]] = ..., orientation_xyzw: _Optional[_Iterable[float]] = ...) -> None: ...

class Pose(_message.Message):
    __slots__ = ("robot", "boot", "sequence", "time_ns", "world_from_camera", "world_from_body", "body_from_camera", "covariance")
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_BODY_FIELD_NUMBER: _ClassVar[int]
    BODY_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    robot: str
    boot: str
    sequence: int
    time_ns: int
    world_from_camera: Transform
    world_from_body: Transform
    body_from_camera: Transform
    covariance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, robot: _Optional[str] = ..., boot: _Optional[str] = ..., sequence: _Optional[int] = ..., time_ns: _Optional[int] = ..., world_from_camera: _Optional[_Union[Transform, _Mapping]] = ..., world_from_body: _Optional[_Union[Transform, _Mapping]] = ..., body_from_camera: _Optional[_Union[Transform, _Mapping]] = ..., covariance: _Optional[_Iterable[float]] = ...) -> None: ...

class Features(_message.Message):
    __slots__ = ("kind", "count", "keypoints", "descriptors", "thumbnail")
    KIND_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    KEYPOINTS_FIELD_NUMBER: _ClassVar[int]
    DESCRIPTORS_FIELD_NUMBER: _ClassVar[int]
    THUMBNAIL_FIELD_NUMBER: _ClassVar[int]
    kind: str
    count: int
    keypoints: bytes
    descriptors: bytes
    thumbnail: bytes
    def __init__(self, kind: _Optional[str] = ..., count: _Optional[int] = ..., keypoints: _Optional[bytes] = ..., descriptors: _Optional[bytes] = ..., thumbnail: _Optional[bytes] = ...) -> None: ...

class Keyframe(_message.Message):
    __slots__ = ("robot", "boot", "sequence", "time_ns", "camera", "world_from_camera", "world_from_body", "body_from_camera", "covariance", "image", "features")
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    BOOT_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_BODY_FIELD_NUMBER: _ClassVar[int]
    BODY_FROM_CAMERA_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    IMAGE_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    robot: str
    boot: str
    sequence: int
    time_ns: int
    camera: Camera
    world_from_camera: Transform
    world_from_body: Transform
    body_from_camera: Transform
    covariance: _containers.RepeatedScalarFieldContainer[float]
    image: bytes
    features: Features
    def __init__(self, robot: _Optional[str] = ..., boot: _Optional[str] = ..., sequence: _Optional[int] = ..., time_ns: _Optional[int] = ..., camera: _Optional[_Union[Camera, _Mapping]] = ..., world_from_camera: _Optional[_Union[Transform, _Mapping]] = ..., world_from_body: _Optional[_Union[Transform, _Mapping]] = ..., body_from_camera: _Optional[_Union[Transform, _Mapping]] = ..., covariance: _Optional[_Iterable[float]] = ..., image: _Optional[bytes] = ..., features: _Optional[_Union[Features, _Mapping]] = ...) -> None: ...

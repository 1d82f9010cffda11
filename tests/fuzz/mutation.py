"""Changes one field of a message and leaves the others whole, where changing bytes would seldom leave a message."""

import random
import struct

from covista_schemas import robot_pb2 as pb
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import DecodeError, Message

_NUMBERS = (0.0, -0.0, 1.0, -1.0, 0.5, 1e-320, 1e-9, 1e6, 1e12, 1e154, 1.7e308, float("inf"), float("nan"))
_WHOLE = (0, 1, 2, 3, 255, 5000, 5001, 65_535, 65_536, 2**31, 2**32 - 1)
_LONG = (2**63 - 1, 2**63, 2**64 - 1)
_TEXTS = ("", "r1", "r2", "b0", "b1", "R1", "r" * 64, "none", "plumb_bob", "equidistant", "rootsift", "orb", "\n", "é")
_BYTES = (b"", b"\x00", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"RIFF\xff\xff\xff\xffWEBP", struct.pack("<ff", 1, 1))


def changed(data: bytes, rng: random.Random) -> bytes | None:
    """The message in `data` with another value in one of its fields; None where there is no message."""
    for kind in rng.sample((pb.Keyframe, pb.Pose), 2):
        message = kind()
        try:
            message.ParseFromString(data)
        except DecodeError:
            continue
        _change(message, rng)
        return message.SerializeToString()
    return None


def _change(message: Message, rng: random.Random) -> None:
    field = rng.choice(message.DESCRIPTOR.fields)
    value = getattr(message, field.name)
    if rng.random() < 0.1:
        message.ClearField(field.name)
    elif field.is_repeated:
        _change_row(value, rng)
    elif field.cpp_type == FieldDescriptor.CPPTYPE_MESSAGE:
        value.SetInParent()
        _change(value, rng)
    else:
        setattr(message, field.name, _value(field, value, rng))


def _change_row(row, rng: random.Random) -> None:
    """All rows are of numbers."""
    if row and rng.random() < 0.7:
        row[rng.randrange(len(row))] = rng.choice((*_NUMBERS, rng.gauss(0, 1)))
    elif row and rng.random() < 0.5:
        row.pop()
    else:
        row.extend([rng.choice(_NUMBERS)] * rng.choice((1, 1, 3, 4, 5, 36)))


def _value(field: FieldDescriptor, value, rng: random.Random):
    match field.cpp_type:
        case FieldDescriptor.CPPTYPE_STRING if field.type == FieldDescriptor.TYPE_STRING:
            return rng.choice(_TEXTS)
        case FieldDescriptor.CPPTYPE_DOUBLE:
            return rng.choice((*_NUMBERS, value * rng.uniform(-2, 2)))
        case FieldDescriptor.CPPTYPE_UINT64:
            return rng.choice((*_WHOLE, *_LONG, (value + 1) % 2**64))
        case FieldDescriptor.CPPTYPE_INT64:
            return rng.choice((*_WHOLE, 2**63 - 1, -(2**63), -1))
        case FieldDescriptor.CPPTYPE_UINT32:
            return rng.choice((*_WHOLE, (value + rng.choice((-1, 1))) % 2**32))
    return _changed_bytes(value, rng)


def _changed_bytes(value: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(value) + 1)
    match rng.randrange(4):
        case 0:
            return value[:at]
        case 1:
            return value[:at] + rng.randbytes(rng.randrange(1, 5)) + value[at + 1 :]
        case 2:
            return rng.choice(_BYTES) + value[at:]
    return value + value[:at]

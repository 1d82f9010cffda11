"""The files of a recording as they stand on disk: dataset.json and overlap_gt.json, checked once, at the door."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from covista_schemas.errors import CovistaError
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

Number = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Triple = tuple[Number, Number, Number]
Quadruple = tuple[Number, Number, Number, Number]
Matrix3 = tuple[Triple, Triple, Triple]
Matrix4 = tuple[Quadruple, Quadruple, Quadruple, Quadruple]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]

DATASET = "dataset.json"
TRUTH = "overlap_gt.json"
_M = TypeVar("_M", bound=BaseModel)


class DatasetError(CovistaError, ValueError):
    """A folder that cannot be used: the text names the file and the field, and says what is wrong."""

    def __init__(self, file: Path, field: str, reason: str) -> None:
        super().__init__(f"{file}: {field}: {reason}" if field else f"{file}: {reason}")
        self.file = file
        self.field = field
        self.reason = reason


def make_folder(folder: Path) -> None:
    """Make a folder to write into, before what is to be written is computed. Raises DatasetError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DatasetError(folder, "", f"cannot be made a folder: {error.strerror}") from error


class FrameFile(BaseModel):
    """One image of a set; `T_wc` is camera-to-world, `H_1_to_this` maps pixels of the first image to this one's."""

    model_config = ConfigDict(frozen=True)

    id: str
    image: str
    depth: str | None = None
    K: Matrix3 | None = None
    T_wc: Matrix4 | None = None
    H_1_to_this: Matrix3 | None = None
    group: str | int | None = None
    view: str | int | None = None


class DatasetFile(BaseModel):
    """dataset.json; fields that are not named here are of no concern."""

    model_config = ConfigDict(frozen=True)

    name: str = ""
    kind: Literal["rgbd", "stereo_disparity", "homography"]
    frames: Annotated[tuple[FrameFile, ...], Field(min_length=2)]
    K: Matrix3 | None = None
    depth_scale: Positive = 1.0
    depth_invalid: tuple[Number, ...] = (0.0,)
    disparity: str | None = None
    disparity_key: str = "arr_0"
    focal_px: Positive | None = None
    baseline_m: Positive | None = None
    doffs: Number = 0.0

    @model_validator(mode="after")
    def _ids_differ(self) -> Self:
        ids = [frame.id for frame in self.frames]
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise ValueError(f"frames: id {twice[0]!r} stands twice")
        return self


class TruthFile(BaseModel):
    """overlap_gt.json: `q[i][j]`, the share of image i whose surface image j sees; null where it is not defined."""

    model_config = ConfigDict(frozen=True)

    ids: tuple[str, ...]
    q: tuple[tuple[Share | None, ...], ...]

    @model_validator(mode="after")
    def _square(self) -> Self:
        n = len(self.ids)
        if len(self.q) != n or any(len(row) != n for row in self.q):
            raise ValueError(f"q: not {n} x {n}, as there are {n} ids")
        return self


def read(file: Path, model: type[_M]) -> _M:
    """The contents of a JSON file; raises DatasetError."""
    try:
        return model.model_validate(json.loads(file.read_text("utf-8")))
    except OSError as error:
        raise DatasetError(file, "", f"cannot be read: {error.strerror or error}") from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        reason = first["msg"].removeprefix("Value error, ")
        raise DatasetError(file, ".".join(str(part) for part in first["loc"]), reason) from error
    except ValueError as error:  # not JSON, or not UTF-8
        raise DatasetError(file, "", f"not JSON: {error}") from error

import io

import httpx
import numpy as np
import pytest
from covista_clients import MissionControl
from covista_schemas.errors import ApiError


def npy(*arrays: np.ndarray) -> bytes:
    file = io.BytesIO()
    for array in arrays:
        np.save(file, array)
    return file.getvalue()


MATRIX, IDS = np.array([[1, 0.5], [np.nan, 1]]), np.array([b"r1", b"robot-2"])


def control(content: bytes) -> MissionControl:
    def answer(request: httpx.Request) -> httpx.Response:
        assert request.headers["Accept"] == "application/x-npy"
        assert dict(request.url.params) == {"matrix": "overlap"}
        return httpx.Response(200, content=content)

    return MissionControl(transport=httpx.MockTransport(answer))


@pytest.mark.parametrize(
    ("matrix", "ids", "robots"),
    [(MATRIX, IDS, ["r1", "robot-2"]), (np.eye(1), np.array([b"r1"]), ["r1"]), (np.zeros((0, 0)), IDS[:0], [])],
)
def test_robots_and_matrix_in_one_order(matrix: np.ndarray, ids: np.ndarray, robots: list[str]) -> None:
    with control(npy(matrix, ids)) as asking:
        told, read = asking.similarity_matrix("overlap")
    assert told == robots
    np.testing.assert_array_equal(read, matrix)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not an array",
        npy(MATRIX),
        npy(MATRIX, IDS)[:-4],
        npy(np.eye(3), IDS),
        npy(MATRIX, MATRIX),
        npy(MATRIX, IDS[:, None]),
        npy(np.array([[{}]]), IDS),
        npy(IDS, IDS),
    ],
)
def test_what_is_no_matrix_is_an_api_error(content: bytes) -> None:
    with control(content) as asking, pytest.raises(ApiError, match="as a station does"):
        asking.similarity_matrix("overlap")

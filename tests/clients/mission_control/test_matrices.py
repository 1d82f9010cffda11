import io

import httpx
import numpy as np
import pytest
from covista_clients import MissionControl
from covista_schemas.errors import ApiError

from tests.clients import sample


def npy(array: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def control(content: bytes, headers: dict[str, str]) -> MissionControl:
    def answer(request: httpx.Request) -> httpx.Response:
        if request.headers["Accept"] != "application/x-npy":
            return httpx.Response(200, content=sample.SIMILARITY.model_dump_json())
        assert dict(request.url.params) == {"matrix": "overlap"}
        return httpx.Response(200, content=content, headers=headers)

    return MissionControl(transport=httpx.MockTransport(answer))


MATRIX = np.array([[1, 0.5], [np.nan, 1]])


@pytest.mark.parametrize("headers", [{"Covista-Robots": "r1,r2"}, {}])
def test_robots_and_matrix_in_one_order(headers: dict[str, str]) -> None:
    with control(npy(MATRIX), headers) as asking:
        robots, matrix = asking.similarity_matrix("overlap")
    assert robots == ["r1", "r2"]
    np.testing.assert_array_equal(matrix, MATRIX)


@pytest.mark.parametrize(
    "content", [b"", b"not an array", npy(MATRIX)[:-4], npy(np.eye(3)), npy(np.array([[{}]])), npy(np.array([["a"]]))]
)
def test_what_is_no_matrix_is_an_api_error(content: bytes) -> None:
    with control(content, {"Covista-Robots": "r1,r2"}) as asking, pytest.raises(ApiError, match="as a station does"):
        asking.similarity_matrix("overlap")

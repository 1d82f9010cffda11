import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.access import AccessError
from covista_service.app import create_app
from covista_service.config import load
from covista_service.store.database import DatabaseError
from covista_service.workers import scheduler


@pytest.mark.parametrize(
    ("name", "value", "refused"),
    [("api", "0.0.0.0:0", AccessError), ("database", "nonsense://somewhere/db", DatabaseError)],
)
def test_what_can_never_work_is_refused_before_anything_is_opened(
    name: str, value: str, refused: type[Exception]
) -> None:
    with pytest.raises(refused, match=name):
        create_app(load({name: value}))


def test_a_cluster_without_its_extra_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError) as caught:
        create_app(load({"workers": "dask://127.0.0.1:8786"}))
    said = str(caught.value)
    assert said == "workers = dask://127.0.0.1:8786 needs an optional extra: pip install 'covista[scale]'"

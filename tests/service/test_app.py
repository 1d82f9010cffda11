import pytest
from covista_service.access import AccessError
from covista_service.app import create_app
from covista_service.config import load
from covista_service.store.database import DatabaseError


@pytest.mark.parametrize(
    ("name", "value", "refused"),
    [("api", "0.0.0.0:0", AccessError), ("database", "nonsense://somewhere/db", DatabaseError)],
)
def test_what_can_never_work_is_refused_before_anything_is_opened(
    name: str, value: str, refused: type[Exception]
) -> None:
    with pytest.raises(refused, match=name):
        create_app(load({name: value}))

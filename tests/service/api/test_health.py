import pytest
from covista_schemas.reports import Health, PartHealth

from tests.service.api.conftest import Desk


@pytest.mark.parametrize("path", ["/healthz", "/readyz"])
@pytest.mark.parametrize(("status", "code"), [("ready", 200), ("degraded", 200), ("starting", 503), ("stopping", 503)])
def test_health_by_status_and_part(path: str, status: str, code: int) -> None:
    health = Health.model_validate({"status": status, "parts": {"store": PartHealth(status="degraded", detail="full")}})
    response = Desk(health=health).ask(path)
    assert response.status_code == code
    assert Health.model_validate_json(response.content) == health

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


def test_metrics_agree_with_the_accounts(desk: Desk) -> None:
    response = desk.ask("/metrics")
    assert response.status_code == 200
    lines = response.text.splitlines()
    assert 'covista_messages_total{fate="received",topic="keyframe"} 2.0' in lines
    assert 'covista_messages_total{fate="used",topic="pose"} 1.0' in lines
    assert 'covista_turned_away_total{reason="wrong_key"} 2.0' in lines
    assert 'covista_robots{status="live"} 3.0' in lines
    assert f"covista_revision {float(desk.scene.snapshot.groups.revision)}" in lines
    assert any(line.startswith("covista_keyframe_to_groups_seconds_bucket") for line in lines)

import logging

import pytest
from covista_service.link.zenoh_log import HANDSHAKE, refused, take

HANDSHAKE_LINE = (
    "2026-01-31T12:00:00.123456Z  WARN acc-0 ThreadId(06) zenoh_link_tls::unicast: "
    "invalid peer certificate: BadSignature. Hint: increase the system open file limit."
)
OTHER_LINE = (
    "2026-01-31T12:00:00.123456Z ERROR ThreadId(01) zenoh::net::runtime::orchestrator: "
    "Unable to connect. Timeout! at /somewhere/orchestrator.rs:388."
)


def test_a_refused_certificate_is_counted_and_told_without_zenoh_s_guess(caplog: pytest.LogCaptureFixture) -> None:
    before = refused[HANDSHAKE]
    assert take(HANDSHAKE_LINE)
    assert refused[HANDSHAKE] == before + 1
    (record,) = caplog.records
    assert (record.levelno, record.fields) == (logging.WARNING, {"said": "invalid peer certificate: BadSignature"})


def test_what_else_zenoh_says_is_told_and_not_counted(caplog: pytest.LogCaptureFixture) -> None:
    before = refused[HANDSHAKE]
    assert take(OTHER_LINE)
    assert refused[HANDSHAKE] == before
    (record,) = caplog.records
    assert record.levelno == logging.ERROR
    assert record.fields == {"said": "Unable to connect. Timeout!", "where": "zenoh::net::runtime::orchestrator"}


@pytest.mark.parametrize("line", ["", "API http://127.0.0.1:8000", "2026-01-31 something"])
def test_what_is_not_zenoh_s_is_left_alone(line: str) -> None:
    assert not take(line)

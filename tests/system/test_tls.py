"""TLS for real: openssl's certificates, a station's process, clients that check whom they talk to."""

import re
import shutil
import signal
import socket
import ssl
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from tests.service.deadline import free_endpoint, wait_until
from tests.system.certificates import Pair, issue, put
from tests.system.station_commands import command, serve, token


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    return issue(tmp_path, "station")


@contextmanager
def serving(folder: Path, pair: Pair) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    process = serve(folder, COVISTA_TLS_CERT=str(pair.cert), COVISTA_TLS_KEY=str(pair.key))
    assert process.stdout is not None
    assert process.stderr is not None
    with process.stdout, process.stderr:
        try:
            found = re.search(r"API (https://[\d.:]+)/api/v1", process.stdout.readline())
            assert found
            yield process, found[1]
        finally:
            process.kill()
            process.wait()


def port_of(url: str) -> int:
    return int(url.rpartition(":")[2])


def shown_at(url: str) -> bytes:
    return ssl.PEM_cert_to_DER_cert(ssl.get_server_certificate(("127.0.0.1", port_of(url)), timeout=10))


def der(pair: Pair) -> bytes:
    return ssl.PEM_cert_to_DER_cert(pair.cert.read_text())


def test_a_client_that_knows_the_certificate_asks_and_others_turn_away(tmp_path: Path, pair: Pair) -> None:
    secret = token(tmp_path, "add", "control")
    known = ssl.create_default_context(cafile=str(pair.cert))
    with serving(tmp_path, pair) as (process, url):
        with httpx.Client(base_url=url, verify=known, timeout=10) as client:
            answer = client.get("/api/v1/groups", headers={"authorization": f"Bearer {secret}"})
            assert answer.status_code == 200
            assert answer.headers["strict-transport-security"].startswith("max-age=")
            assert client.get("/api/v1/groups").status_code == 401
        with pytest.raises(httpx.ConnectError, match="certificate verify failed"):
            httpx.get(f"{url}/healthz")
        with pytest.raises(httpx.HTTPError):
            httpx.get(f"{url.replace('https', 'http')}/healthz")
        old = ssl.create_default_context(cafile=str(pair.cert))
        old.minimum_version, old.maximum_version = ssl.TLSVersion.MINIMUM_SUPPORTED, ssl.TLSVersion.TLSv1_2
        plain = socket.create_connection(("127.0.0.1", port_of(url)))
        with plain, old.wrap_socket(plain, server_hostname="localhost") as wrapped:
            assert wrapped.version() == "TLSv1.2"
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0


def test_a_renewed_certificate_is_shown_after_a_hangup_and_connections_go_on(tmp_path: Path, pair: Pair) -> None:
    (tmp_path / "new").mkdir()
    other = issue(tmp_path / "new", "station")
    known = ssl.create_default_context(cafile=str(pair.cert))
    with serving(tmp_path, pair) as (process, url), httpx.Client(base_url=url, verify=known, timeout=10) as client:
        client.get("/healthz")
        assert shown_at(url) == der(pair)
        put(other, pair)
        process.send_signal(signal.SIGHUP)
        wait_until(lambda: shown_at(url) == der(other), "the new one is shown")
        assert client.get("/healthz").status_code in (200, 503)
        shutil.copy(tmp_path / "new" / "station.key", pair.cert)
        process.send_signal(signal.SIGHUP)
        assert shown_at(url) == der(other)
        assert process.poll() is None


def test_a_renewed_certificate_is_found_without_being_told(tmp_path: Path, pair: Pair) -> None:
    (tmp_path / "new").mkdir()
    other = issue(tmp_path / "new", "station")
    with serving(tmp_path, pair) as (_, url):
        put(other, pair)
        wait_until(lambda: shown_at(url) == der(other), "the new one is shown", 60)


def test_a_certificate_that_cannot_be_used_is_one_line_before_it_listens(tmp_path: Path, pair: Pair) -> None:
    listening = ("serve", "--api", "127.0.0.1:0", "--link", free_endpoint())
    for variables, status, said in (
        ({"COVISTA_TLS_CERT": str(pair.cert)}, 2, "setting tls_cert needs tls_key"),
        ({"COVISTA_TLS_CERT": str(pair.cert), "COVISTA_TLS_KEY": "absent.pem"}, 1, "absent.pem cannot be read"),
        ({"COVISTA_TLS_CERT": str(pair.cert), "COVISTA_TLS_KEY": str(pair.cert)}, 1, "not a certificate and its key"),
    ):
        done = command(tmp_path, *listening, **variables)
        assert done.returncode == status
        (line,) = done.stderr.splitlines()
        assert said in line

import shutil
import ssl
from pathlib import Path

import pytest
from covista_service.access.certificates import CertificateError, Certificates

from tests.system.certificates import Pair, issue, put


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("certificates")


@pytest.fixture(scope="module")
def first(folder: Path) -> Pair:
    return issue(folder, "first")


@pytest.fixture(scope="module")
def second(folder: Path) -> Pair:
    return issue(folder, "second")


@pytest.fixture
def used(tmp_path: Path, first: Pair) -> Pair:
    pair = Pair(tmp_path / "cert.pem", tmp_path / "key.pem")
    put(first, pair)
    return pair


def shown_by(certificates: Certificates) -> bytes:
    """The certificate that a client sees, from a handshake in memory."""
    client_context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client_context.check_hostname, client_context.verify_mode = False, ssl.CERT_NONE
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = client_context.wrap_bio(to_client, to_server)
    server = certificates.context.wrap_bio(to_server, to_client, server_side=True)
    for _ in range(3):
        for side in (client, server):
            try:
                side.do_handshake()
            except ssl.SSLWantReadError:
                continue
    found = client.getpeercert(binary_form=True)
    assert found is not None
    return found


def der(pair: Pair) -> bytes:
    return ssl.PEM_cert_to_DER_cert(pair.cert.read_text())


def test_it_shows_its_certificate_by_tls_1_2_or_newer(used: Pair, first: Pair) -> None:
    certificates = Certificates(used.cert, used.key)
    assert shown_by(certificates) == der(first)
    assert certificates.context.minimum_version is ssl.TLSVersion.TLSv1_2


def test_a_new_one_is_taken_up_when_its_files_have_changed(used: Pair, second: Pair) -> None:
    certificates = Certificates(used.cert, used.key)
    assert not certificates.is_changed()
    put(second, used)
    assert certificates.is_changed()
    assert certificates.renew()
    assert not certificates.is_changed()
    assert shown_by(certificates) == der(second)


def test_a_half_renewed_one_is_left_alone_until_its_key_has_come(used: Pair, first: Pair, second: Pair) -> None:
    certificates = Certificates(used.cert, used.key)
    shutil.copy(second.cert, used.cert)
    assert not certificates.renew()
    assert shown_by(certificates) == der(first)
    shutil.copy(second.key, used.key)
    assert certificates.is_changed()
    assert certificates.renew()
    assert shown_by(certificates) == der(second)


def test_files_that_are_gone_are_left_alone(used: Pair, first: Pair) -> None:
    certificates = Certificates(used.cert, used.key)
    used.key.unlink()
    assert certificates.is_changed()
    assert not certificates.renew()
    assert not certificates.is_changed()
    assert shown_by(certificates) == der(first)


def test_what_cannot_be_used_is_one_line(folder: Path, first: Pair, second: Pair, tmp_path: Path) -> None:
    locked = issue(folder, "locked", "-passout", "pass:hush")
    nonsense = tmp_path / "nonsense.pem"
    nonsense.write_text("no PEM")
    absent = tmp_path / "absent.pem"
    cases = [
        (absent, first.key, rf"setting tls_cert: {absent} cannot be read: No such file"),
        (first.cert, absent, rf"setting tls_key: {absent} cannot be read: No such file"),
        (first.cert, tmp_path, rf"setting tls_key: {tmp_path} cannot be read: Is a directory"),
        (first.cert, second.key, "are not a certificate and its key"),
        (nonsense, first.key, "are not a certificate and its key"),
        (first.cert, nonsense, "are not a certificate and its key"),
        (locked.cert, locked.key, "the key without a password"),
    ]
    for cert, key, said in cases:
        with pytest.raises(CertificateError, match=said) as caught:
            Certificates(cert, key)
        assert "\n" not in str(caught.value)


def test_one_with_another_kind_of_key_is_shown_once_it_is_there(folder: Path, used: Pair) -> None:
    certificates = Certificates(used.cert, used.key)
    for other in (issue(folder, "of-rsa", "-newkey", "rsa:2048"), issue(folder, "of-ec")):
        put(other, used)
        assert certificates.renew()
        assert shown_by(certificates) == der(other)

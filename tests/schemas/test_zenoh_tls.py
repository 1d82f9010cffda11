"""What is wrong with certificates is said before zenoh is asked, which does not say."""

import subprocess
from pathlib import Path

import pytest
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_tls import Tls

from tests.system.certificates import issue, make_certificates, tls_of


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_certificates(tmp_path_factory.mktemp("certs"), "r1")
    make_certificates(folder / "foreign", "r1")
    (folder / "text.pem").write_text("no certificate")
    issue(folder, "locked", "-passout", "pass:secret")
    return folder


@pytest.mark.parametrize("name", ["r1", "station", "router"])
def test_a_certificate_tells_whose_it_is(certs: Path, name: str) -> None:
    assert tls_of(certs, name).common_name() == name


@pytest.mark.parametrize(
    ("ca", "cert", "key", "said"),
    [
        ("absent.pem", "r1.pem", "r1.key", r"the authority .*absent\.pem cannot be read: No such file"),
        ("ca.pem", "absent.pem", "r1.key", r"the certificate .*absent\.pem cannot be read"),
        ("ca.pem", "r1.pem", "absent.key", r"the key .*absent\.key cannot be read"),
        ("ca.pem", "r1.pem", "station.key", r"are not a certificate and its key.*\(KEY_VALUES_MISMATCH\)"),
        ("ca.pem", "text.pem", "r1.key", "are not a certificate and its key"),
        ("text.pem", "r1.pem", "r1.key", "is no authority"),
        ("ca.pem", "locked.pem", "locked.key", "without a password"),
        ("foreign/ca.pem", "r1.pem", "r1.key", r"is not let in by the authority .*foreign/ca\.pem"),
        ("ca.pem", "foreign/r1.pem", "foreign/r1.key", r"is not let in by the authority"),
    ],
)
def test_files_of_no_use_are_one_line(certs: Path, ca: str, cert: str, key: str, said: str) -> None:
    with pytest.raises(LinkError, match=said) as caught:
        Tls(certs / ca, certs / cert, certs / key).common_name()
    assert "\n" not in str(caught.value)


def test_a_certificate_that_is_out_of_date_is_of_no_use(certs: Path, tmp_path: Path) -> None:
    request = ["openssl", "req", "-new", "-key", certs / "r1.key", "-subj", "/CN=r1", "-out", tmp_path / "r1.csr"]
    sign = ["openssl", "x509", "-req", "-in", tmp_path / "r1.csr", "-CA", certs / "ca.pem", "-CAkey", certs / "ca.key"]
    sign += ["-set_serial", "7", "-days", "-1", "-out", tmp_path / "r1.pem"]
    for command in (request, sign):
        subprocess.run(command, check=True, capture_output=True)
    with pytest.raises(LinkError, match="certificate has expired"):
        Tls(certs / "ca.pem", tmp_path / "r1.pem", certs / "r1.key").common_name()


def test_names_of_files_have_a_place_for_the_robot() -> None:
    swarm = Tls("certs/ca.pem", "certs/{robot}.pem", Path("certs/{robot}.key"))
    assert swarm.is_of_each
    assert swarm.of("r7") == Tls("certs/ca.pem", "certs/r7.pem", "certs/r7.key")
    assert not swarm.of("r7").is_of_each


def test_robots_are_added_later_and_what_is_there_stays(tmp_path: Path) -> None:
    make_certificates(tmp_path, "r1")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    make_certificates(tmp_path, "r1", "r2")
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert after.keys() - before.keys() == {"r2.pem", "r2.key"}
    assert {name for name in before if before[name] != after[name]} == {"robots.txt"}
    assert after["robots.txt"] == b"r1\nr2\n"
    assert {path.stat().st_mode & 0o777 for path in tmp_path.glob("*.key")} == {0o600}


@pytest.mark.parametrize("robot", ["R1", "../r1", "station", "ca", ""])
def test_a_name_that_is_no_robots_gets_no_certificate(tmp_path: Path, robot: str) -> None:
    with pytest.raises(subprocess.CalledProcessError) as caught:
        make_certificates(tmp_path, robot)
    assert caught.value.stderr.decode().startswith("certs.sh: ")
    assert not list(tmp_path.iterdir())

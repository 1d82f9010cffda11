"""What is wrong with certificates is said before zenoh is asked, which does not say."""

from pathlib import Path

import pytest
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_tls import Tls

from tests.system.certificates import issue, make_certificates, sign, tls_of


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


def test_a_certificate_that_is_out_of_date_is_of_no_use(certs: Path) -> None:
    assert sign(certs, "r1", days=1).common_name() == "r1"
    with pytest.raises(LinkError, match="certificate has expired"):
        sign(certs, "r1", days=-1).common_name()


def test_a_station_s_certificate_is_one_that_robots_connect_to(certs: Path) -> None:
    assert tls_of(certs, "station").common_name(listens=True) == "station"
    joins = sign(certs, "station", usage="clientAuth")
    assert joins.common_name() == "station"
    with pytest.raises(LinkError, match=r"is none that robots connect to, .* \(unsuitable certificate purpose\)"):
        joins.common_name(listens=True)
    with pytest.raises(LinkError, match="is not let in by the authority"):
        sign(certs, "station", usage="serverAuth").common_name(listens=True)


def test_a_certificate_without_extensions_is_of_no_use(certs: Path) -> None:
    with pytest.raises(LinkError, match=r"X\.509 version 1, and has to be of 3"):
        sign(certs, "r1", usage=None).common_name()


def test_names_of_files_have_a_place_for_the_robot() -> None:
    swarm = Tls("certs/ca.pem", "certs/{robot}.pem", Path("certs/{robot}.key"))
    assert swarm.is_of_each
    assert swarm.of("r7") == Tls("certs/ca.pem", "certs/r7.pem", "certs/r7.key")
    assert not swarm.of("r7").is_of_each

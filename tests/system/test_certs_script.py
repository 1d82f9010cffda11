"""What docker/certs.sh makes, and what it leaves alone."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.system.certificates import CERTS, make_certificates


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certs"), "r1")


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """Certificates of one's own, to be harmed."""
    return Path(shutil.copytree(made, tmp_path / "certs"))


def refusal(folder: Path, *robots: str) -> str:
    with pytest.raises(subprocess.CalledProcessError) as caught:
        make_certificates(folder, *robots)
    said: str = caught.value.stderr.decode()
    assert said.startswith("certs.sh: ")
    return said


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_robots_are_added_later_and_what_is_there_stays(tmp_path: Path) -> None:
    make_certificates(tmp_path, "r1")
    before = contents(tmp_path)
    make_certificates(tmp_path, "r1", "r2")
    after = contents(tmp_path)
    assert after.keys() - before.keys() == {"r2.pem", "r2.key"}
    assert {name for name in before if before[name] != after[name]} == {"robots.txt"}
    assert after["robots.txt"] == b"r1\nr2\n"
    assert {path.stat().st_mode & 0o777 for path in tmp_path.glob("*.key")} == {0o600}


@pytest.mark.parametrize("robot", ["R1", "../r1", "station", "ca", ""])
def test_a_name_that_is_no_robots_gets_no_certificate(tmp_path: Path, robot: str) -> None:
    refusal(tmp_path, robot)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("moved", ["ca.pem", "ca.key", "station.pem", "station.key", "r1.key"])
def test_half_of_a_pair_is_put_back_by_whoever_took_it_away(folder: Path, moved: str) -> None:
    (folder / moved).rename(folder.parent / moved)
    before = contents(folder)
    assert moved in refusal(folder, "r1", "r2")
    assert contents(folder) == before
    (folder.parent / moved).rename(folder / moved)
    make_certificates(folder, "r1")
    assert contents(folder) == before | {moved: (folder / moved).read_bytes()}


@pytest.mark.parametrize("name", ["r2.pem", "r2.key", "robots.txt"])
def test_a_folder_in_the_place_of_a_file_is_no_file(folder: Path, name: str) -> None:
    (folder / name).unlink(missing_ok=True)
    (folder / name).mkdir()
    before = contents(folder)
    assert f"{name} is no file; docker makes a folder" in refusal(folder, "r2")
    assert contents(folder) == before


def test_an_empty_file_is_no_certificate(folder: Path) -> None:
    (folder / "station.pem").write_text("")
    assert "station.pem is empty" in refusal(folder, "r2")


def test_what_others_have_put_into_the_folder_stays_as_it_is(folder: Path) -> None:
    for name in ("other.pem", "other.key"):
        (folder / name).write_text("somebody's")
        (folder / name).chmod(0o640)
    folder.chmod(0o750)
    (folder / "robots.txt").chmod(0o664)
    make_certificates(folder, "r2")
    modes = {path.name: path.stat().st_mode & 0o777 for path in (folder, *folder.iterdir())}
    assert (modes["other.pem"], modes["other.key"], modes["certs"], modes["robots.txt"]) == (0o640, 0o640, 0o750, 0o664)
    assert (modes["r2.pem"], modes["r2.key"]) == (0o644, 0o600)
    owners = {name: (folder / name).stat().st_uid for name in ("other.pem", "other.key", "ca.key", "r2.key")}
    # Called by root, it gives away the keys that it makes.
    assert owners == dict.fromkeys(owners, os.getuid()) | {"r2.key": 10001 if os.getuid() == 0 else os.getuid()}


def test_a_folder_that_it_makes_is_open_to_containers(tmp_path: Path) -> None:
    make_certificates(tmp_path / "new")
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o755


def test_a_list_whose_last_line_was_not_ended_gets_a_line_more(folder: Path) -> None:
    (folder / "robots.txt").write_text("# ours\nr1\nr7")
    make_certificates(folder, "r1", "r2")
    assert (folder / "robots.txt").read_text() == "# ours\nr1\nr7\nr2\n"


def test_hosts_are_names_or_addresses(tmp_path: Path) -> None:
    hosts = {"COVISTA_CERTS_HOSTS": "ground.example,10.0.0.4,fd00::a1,::1"}
    subprocess.run([CERTS, tmp_path], check=True, capture_output=True, env=os.environ | hosts)
    show = ["openssl", "x509", "-in", tmp_path / "station.pem", "-noout", "-ext", "subjectAltName"]
    named = subprocess.run(show, check=True, capture_output=True, text=True).stdout.splitlines()[1].strip().split(", ")
    assert named[3:] == [
        "DNS:ground.example",
        "IP Address:10.0.0.4",
        "IP Address:FD00:0:0:0:0:0:0:A1",
        "IP Address:0:0:0:0:0:0:0:1",
    ]

"""Certificates as an operator makes them: with openssl."""

import os
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from covista_schemas.zenoh_tls import Tls

CERTS = Path(__file__).parents[2] / "docker" / "certs.sh"
_EXTENSIONS = """
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = {usage}
subjectAltName = DNS:{name},DNS:localhost,IP:127.0.0.1
subjectKeyIdentifier = hash
authorityKeyIdentifier = keyid
"""
_BOOKS = """
[ca]
default_ca = books
[books]
database = {books}/index
serial = {books}/serial
new_certs_dir = {books}
default_md = sha256
policy = names
x509_extensions = extensions
[names]
commonName = supplied
[extensions]
"""


@dataclass(frozen=True)
class Pair:
    """A certificate for this machine, and its key."""

    cert: Path
    key: Path


def issue(folder: Path, name: str, *flags: str) -> Pair:
    """A certificate that signs itself; `name` is its subject, and `flags` may ask for another kind of key."""
    pair = Pair(folder / f"{name}.pem", folder / f"{name}.key")
    own = ["-nodes"] if "-passout" not in flags else []
    key = [] if "-newkey" in flags else ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1"]
    request = f"req -x509 -days 2 -subj /CN={name}"
    places = f"-addext subjectAltName=IP:127.0.0.1,DNS:localhost -keyout {pair.key} -out {pair.cert}"
    subprocess.run(
        ["openssl", *request.split(), *places.split(), *key, *own, *flags],
        check=True,
        capture_output=True,
        stdin=subprocess.DEVNULL,
    )
    return pair


def put(source: Pair, target: Pair) -> None:
    """Renew as tools do: a new file in the place of the old one, one after the other."""
    for new, place in ((source.cert, target.cert), (source.key, target.key)):
        beside = place.with_suffix(".new")
        beside.write_bytes(new.read_bytes())
        os.replace(beside, place)


def make_certificates(folder: Path, *robots: str) -> Path:
    """An authority, and certificates for station, router and robots, by the script that operators have."""
    subprocess.run([CERTS, folder, *robots], check=True, capture_output=True)
    return folder


def sign(folder: Path, name: str, *, days: int = 1, usage: str | None = "clientAuth", curve: str = "") -> Tls:
    """Another certificate of one of them, for its key or one of another `curve`, as the script makes them.

    With `days` -1 it was good until yesterday; without `usage` it has no extensions, and is one of X.509 version 1.
    """
    tls = tls_of(folder, name)
    stem = f"{name}-{days}-{usage}-{curve}".replace(",", "-")
    key, request, cert = folder / f"{stem}.key", folder / f"{stem}.csr", folder / f"{stem}.pem"
    if curve:
        _openssl("genpkey", "-algorithm", "EC", "-pkeyopt", f"ec_paramgen_curve:{curve}", "-out", key)
    else:
        key = Path(tls.key)
    _openssl("req", "-new", "-key", key, "-subj", f"/CN={name}", "-out", request)
    extensions: list[str | Path] = []
    if usage is not None:
        (folder / f"{stem}.cnf").write_text(_EXTENSIONS.format(usage=usage, name=name))
        extensions = ["-extfile", folder / f"{stem}.cnf"]
    signed = ("-CA", tls.ca, "-CAkey", folder / "ca.key", "-set_serial", "7", "-days", str(days), "-out", cert)
    _openssl("x509", "-req", "-in", request, "-sha256", *signed, *extensions)
    if usage is None and "Version: 1 " not in _openssl("x509", "-in", cert, "-noout", "-text"):
        pytest.skip("OpenSSL of 3.2 and later makes none of version 1")
    return Tls(tls.ca, cert, key)


def sign_for(folder: Path, name: str, seconds: int) -> Tls:
    """A certificate that is over after so many seconds, for which OpenSSL wants an authority with books."""
    tls, books = tls_of(folder, name), folder / "books"
    books.mkdir()
    (books / "index").touch()
    (books / "serial").write_text("07\n")
    (folder / "short.cnf").write_text(_BOOKS.format(books=books) + _EXTENSIONS.format(usage="clientAuth", name=name))
    _openssl("req", "-new", "-key", tls.key, "-subj", f"/CN={name}", "-out", folder / "short.csr")
    now = datetime.now(UTC)
    start, end = (f"{at:%y%m%d%H%M%SZ}" for at in (now - timedelta(hours=1), now + timedelta(seconds=seconds)))
    signed = ("-cert", tls.ca, "-keyfile", folder / "ca.key", "-in", folder / "short.csr", "-out", folder / "short.pem")
    _openssl("ca", "-batch", "-notext", "-config", folder / "short.cnf", *signed, "-startdate", start, "-enddate", end)
    return Tls(tls.ca, folder / "short.pem", tls.key)


def _openssl(*words: str | Path) -> str:
    return subprocess.run(["openssl", *words], check=True, capture_output=True, text=True).stdout


def tls_of(folder: Path, name: str) -> Tls:
    """The files of one of them."""
    return Tls(folder / "ca.pem", folder / f"{name}.pem", folder / f"{name}.key")

"""Who one is on zenoh: a certificate, its key, and the authority that vouches for everybody else's."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path

from covista_schemas.errors import LinkError

# Stands for a robot's id in names of files.
PLACE = "{robot}"
# Turns of a handshake in memory: it takes three.
_TURNS = 6
# Of X.509: what has extensions.
_VERSION = "3"


@dataclass(frozen=True, slots=True)
class Tls:
    """Three PEM files for mutual TLS: `ca` signs all certificates, `cert` is one's own, `key` its key, unencrypted."""

    ca: Path | str
    cert: Path | str
    key: Path | str

    def of(self, robot: str) -> Tls:
        """The files of one robot, where names of files have {robot} in the place of its id."""
        return Tls(*(str(path).replace(PLACE, robot) for path in (self.ca, self.cert, self.key)))

    @property
    def is_of_each(self) -> bool:
        """Whether each robot has files of its own."""
        return any(PLACE in str(path) for path in (self.cert, self.key))

    def common_name(self, *, listens: bool = False) -> str:
        """Whose certificate it is, once it has proved to be one that others let in, or connect to, if it `listens`.

        Raises LinkError for what cannot be read, does not fit together, is out of date, of another authority, or for
        another use.
        """
        for what, path in (("the authority", self.ca), ("the certificate", self.cert), ("the key", self.key)):
            _check_readable(what, path)
        listening, joining = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        joining.check_hostname, joining.verify_mode = False, ssl.CERT_NONE
        listening.verify_mode = ssl.CERT_REQUIRED
        try:
            listening.load_verify_locations(self.ca)
        except (ssl.SSLError, OSError, ValueError) as error:
            raise LinkError(f"{self.ca} is no authority, a certificate as PEM ({_reason(error)})") from error
        try:
            for context in (listening, joining):
                context.load_cert_chain(self.cert, self.key, _no_password)
        except (ssl.SSLError, OSError, ValueError) as error:
            raise LinkError(
                f"{self.cert} and {self.key} are not a certificate and its key, both PEM and the key without a "
                f"password ({_reason(error)})"
            ) from error
        name = self._try(listening, joining, f"is not let in by the authority {self.ca}")
        if listens:
            listening.verify_mode = ssl.CERT_NONE
            joining.load_verify_locations(self.ca)
            joining.verify_mode = ssl.CERT_REQUIRED
            self._try(listening, joining, f"is none that robots connect to, by the authority {self.ca}")
        return name

    def _try(self, listening: ssl.SSLContext, joining: ssl.SSLContext, refused: str) -> str:
        try:
            return _shake_hands(listening, joining)
        except ssl.SSLError as error:
            said = getattr(error, "verify_message", None) or _reason(error)
            raise LinkError(f"{self.cert} {refused} ({said})") from error


def _check_readable(what: str, path: Path | str) -> None:
    try:
        Path(path).read_bytes()
    except OSError as error:
        raise LinkError(f"{what} {path} cannot be read: {error.strerror}") from error


def _shake_hands(listening: ssl.SSLContext, joining: ssl.SSLContext) -> str:
    """The name of who shows a certificate, in memory: what is refused here zenoh refuses, and does not say why.

    Whoever of the two asks for a certificate has it checked.
    """
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    server, client = listening.wrap_bio(there, back, server_side=True), joining.wrap_bio(back, there)
    for _ in range(_TURNS):
        for side in (client, server):
            try:
                side.do_handshake()
            except ssl.SSLWantReadError:
                continue
    shown = client.getpeercert() or server.getpeercert() or {}
    # OpenSSL takes older ones too, and zenoh does not.
    version = str(shown.get("version", _VERSION))
    if version != _VERSION:
        raise LinkError(f"the certificate is one of X.509 version {version}, and has to be of {_VERSION}")
    # A name has parts, and a part has pairs; the type that typeshed gives is that of every entry.
    subject: tuple[tuple[tuple[str, str], ...], ...] = shown.get("subject", ())  # type: ignore[assignment]
    for name, value in (pair for part in subject for pair in part):
        if name == "commonName":
            return value
    raise LinkError("the certificate has no common name (CN), and so belongs to nobody")


def _reason(error: Exception) -> str:
    return str(getattr(error, "reason", None) or error)


def _no_password() -> str:
    """Without this OpenSSL asks on the terminal, and waits."""
    return ""

"""The station's certificate: read from two files, and read again when they change, while connections go on."""

from __future__ import annotations

import logging
import ssl
from pathlib import Path

from covista_schemas.errors import CovistaError

from covista_service.access.stamps import Stamp, stamps_of

log = logging.getLogger(__name__)


class CertificateError(CovistaError):
    """The station cannot prove who it is; the text is one line that says what to change."""


class Certificates:
    """A certificate (PEM, with what stands between it and the root) and its key. Raises CertificateError."""

    def __init__(self, cert: Path, key: Path) -> None:
        self._cert = cert
        self._key = key
        self._seen = self._stamp()
        self._newest = _load(cert, key)
        # The one that is served; each connection takes up the newest. What is loaded over a certificate with another
        # kind of key would not be shown.
        self.context = _load(cert, key)
        self.context.sni_callback = self._present

    def is_changed(self) -> bool:
        """Whether the files are others than those looked at last."""
        return self._stamp() != self._seen

    def renew(self) -> bool:
        """Take up what is in the files now; what cannot be used is left alone, and the certificate stays as it was."""
        self._seen = self._stamp()
        try:
            self._newest = _load(self._cert, self._key)
        except CertificateError as error:
            log.warning("the certificate stays as it was: %s", error)
            return False
        log.info("the certificate is renewed")
        return True

    def _present(self, connection: ssl.SSLObject | ssl.SSLSocket, _name: str | None, _served: ssl.SSLContext) -> None:
        connection.context = self._newest

    def _stamp(self) -> Stamp:
        return stamps_of((self._cert, self._key))


def _load(cert: Path, key: Path) -> ssl.SSLContext:
    """A context with this certificate, of TLS 1.2 or newer. Raises CertificateError."""
    for name, path in (("tls_cert", cert), ("tls_key", key)):
        try:
            path.read_bytes()
        except OSError as error:
            raise CertificateError(f"setting {name}: {path} cannot be read: {error.strerror}") from error
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.set_alpn_protocols(["http/1.1"])
    try:
        context.load_cert_chain(cert, key, _no_password)
    except (ssl.SSLError, OSError, ValueError) as error:
        said = getattr(error, "reason", None) or str(error)
        raise CertificateError(
            f"settings tls_cert and tls_key: {cert} and {key} are not a certificate and its key, both PEM and the key "
            f"without a password ({said})"
        ) from error
    return context


def _no_password() -> str:
    """Without this OpenSSL asks on the terminal, and waits."""
    return ""

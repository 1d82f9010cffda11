"""Zenoh configurations that robots and station open their sessions with.

Scouting is off and end points are explicit; shared memory is off, since it bypasses the limit on message sizes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Literal

import zenoh

from covista_schemas.errors import LinkError
from covista_schemas.zenoh_tls import Tls

# What is larger is dropped without a word by whoever receives it, and the link is kept.
MAX_MESSAGE_BYTES = 4 * 1024 * 1024
# The most that an answer may have: what zenoh adds to it counts too.
MAX_REPLY_BYTES = MAX_MESSAGE_BYTES - 16 * 1024
# A dead link is noticed after some 1.6 s, not 10 s.
LEASE_MS = 2000
# How often a router that does not answer is tried: soon at first, and every .4 s in the end. Whoever has waited for a
# station to start should not wait for another second.
RETRY = {"period_init_ms": 100, "period_max_ms": 400, "period_increase_factor": 2}
# So many poses may wait while something large is written to a slow link; each waits by itself.
POSES_WAITING = 16
_INTERNET = re.compile(r"(?:tcp|udp|tls|quic|ws)/(?:\[[0-9a-fA-F:.]+\]|[^\s/:\[\]]+):(?P<port>\d{1,5})(?:[?#]\S*)?")
_OWN_TLS = re.compile("certificate|private_key|mtls|verify_name")
# Options of an end point that cannot weaken its certificates: on which interface, and the socket's.
_HARMLESS = re.compile("iface|so_[a-z_]+")
_OTHER = re.compile(r"(?:unixsock-stream|unixpipe|serial|vsock)/\S+")


def check_endpoint(endpoint: str) -> str:
    """Return `endpoint` if it can be one, such as tcp/127.0.0.1:7447, else raise LinkError.

    Zenoh finds out only when it opens a session, and cannot tell a bad end point from a router that is not there.
    """
    internet = _INTERNET.fullmatch(endpoint)
    if _OTHER.fullmatch(endpoint) or (internet and int(internet["port"]) <= 65_535):
        return endpoint
    raise LinkError(f"{endpoint!r} is not an end point such as tcp/127.0.0.1:7447")


def check_transport(endpoint: str, locked: bool) -> None:
    """Raise LinkError for a plain end point where there are certificates, and for one of TLS where there are none."""
    secure, shown = endpoint.startswith("tls/"), repr(endpoint.split("#")[0])
    if locked and not secure:
        raise LinkError(f"{shown} is a plain end point; with certificates for zenoh it must be tls/")
    if locked and has_own_tls(endpoint):
        raise LinkError(f"{shown} must not have certificates of its own beside those for zenoh")
    others = [each for each in _options(endpoint) if not _HARMLESS.fullmatch(each)]
    if locked and others:
        raise LinkError(f"{shown} must not have the option {others[0][:80]!r} beside certificates: iface or so_* alone")
    if secure and not locked and not has_own_tls(endpoint):
        raise LinkError(f"{shown} needs certificates for zenoh: an authority, one's own, and its key")


def has_own_tls(endpoint: str) -> bool:
    """Whether the options of an end point say which certificates it takes; access control does not know of those."""
    return endpoint.startswith("tls/") and _OWN_TLS.search(endpoint.partition("#")[2]) is not None


def _options(endpoint: str) -> list[str]:
    return [each.partition("=")[0] for each in endpoint.partition("#")[2].split(";") if each]


def config(
    mode: Literal["client", "router"],
    *,
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    timeout_ms: int = 1000,
    tls: Tls | None = None,
) -> zenoh.Config:
    """Configuration of a session; `connect` and `listen` are end points such as tcp/127.0.0.1:7447.

    A client that finds no router within `timeout_ms` fails to open. With `tls` both sides of a link prove who they are,
    and no end point may be a plain one. Raises LinkError for end points that cannot be.
    """
    for endpoint in (*connect, *listen):
        check_endpoint(endpoint)
        check_transport(endpoint, tls is not None)
    made = zenoh.Config()
    values: dict[str, object] = {
        "mode": mode,
        "connect/endpoints": list(connect),
        "connect/timeout_ms": timeout_ms,
        "connect/exit_on_failure": mode == "client",
        "connect/retry": RETRY,
        "listen/endpoints": list(listen),
        "listen/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        "timestamping/enabled": True,
    }
    if tls is not None:
        values["transport/link/tls"] = _mutual(tls)
    if mode == "client":
        values["transport/link/tx/queue/size/interactive_high"] = POSES_WAITING
    for key, value in values.items():
        try:
            made.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise LinkError(f"zenoh refuses {key} = {value!r}: {error}") from error
    return made


def _mutual(tls: Tls) -> dict[str, object]:
    """Both sides show certificates, and who joins checks the name of whom it joins."""
    return {
        "root_ca_certificate": str(tls.ca),
        "listen_certificate": str(tls.cert),
        "listen_private_key": str(tls.key),
        "connect_certificate": str(tls.cert),
        "connect_private_key": str(tls.key),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        # Who was let in does not stay when its certificate is over.
        "close_link_on_expiration": True,
    }

"""Where the station may listen: beyond this machine only with access control, unless the operator says otherwise."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from ipaddress import ip_address

from covista_schemas.errors import CovistaError
from covista_schemas.zenoh_config import has_own_tls

from covista_service.telemetry import about

_LOCAL_PROTOCOLS = ("unixsock-stream", "unixpipe")

log = logging.getLogger(__name__)


class AccessError(CovistaError):
    """The station would be open to everybody on the network."""


def check_listening(
    api_host: str, endpoints: Sequence[str], *, insecure: bool, has_tokens: Callable[[], bool] = lambda: False
) -> None:
    """Refuse to listen beyond loopback without access control, unless `insecure`. Raises AccessError.

    The API has it where there are tokens; `has_tokens` is asked only where that matters. The zenoh link has it where it
    is one of TLS.
    """
    if insecure:
        warn_of_open_doors(endpoints)
        return
    beyond, reasons = open_to_all(endpoints), []
    if not is_loopback(api_host) and not has_tokens():
        reasons.append(
            f"api = {api_host} would be open to the network, for there is no token yet (covista-station token add NAME)"
        )
    if beyond:
        reasons.append(
            f"link = {', '.join(beyond)} would be open to the network, for it is plain (tls/ and zenoh_tls_* lock it)"
        )
    if reasons:
        raise AccessError(
            f"{' and '.join(reasons)}; choose a loopback address, or set insecure (--insecure, COVISTA_INSECURE=true)"
        )


def warn_of_open_doors(endpoints: Sequence[str]) -> None:
    """Have the log say where everybody comes in."""
    beyond = open_to_all(endpoints)
    if beyond:
        log.warning(
            "the zenoh link is plain: everybody who reaches it can publish as any robot",
            extra=about(link=", ".join(beyond)),
        )


def open_to_all(endpoints: Sequence[str]) -> list[str]:
    """The end points, without their options, that others than this machine reach and that ask for no certificate."""
    return [each.split("#")[0] for each in endpoints if not (is_local(each) or _is_locked(each))]


def _is_locked(endpoint: str) -> bool:
    return endpoint.startswith("tls/") and not has_own_tls(endpoint)


def is_loopback(host: str) -> bool:
    """Whether `host` is this machine only; names other than localhost are not resolved, hence not trusted."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def is_local(endpoint: str) -> bool:
    """Whether a zenoh end point, such as tcp/127.0.0.1:7447, is reached from this machine only."""
    protocol, _, rest = endpoint.partition("/")
    if protocol in _LOCAL_PROTOCOLS:
        return True
    # What follows ? and # are metadata and options of the end point.
    address = rest.split("?")[0].split("#")[0]
    return is_loopback(address.rpartition(":")[0].strip("[]"))

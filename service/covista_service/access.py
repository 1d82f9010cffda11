"""Who may listen and ask: until there are tokens, nobody beyond this machine unless the operator says so."""

from __future__ import annotations

from collections.abc import Sequence
from ipaddress import ip_address

from covista_schemas.errors import CovistaError

_LOCAL_PROTOCOLS = ("unixsock-stream", "unixpipe")


class AccessError(CovistaError):
    """The station would be open to everybody on the network."""


def check_listening(api_host: str, endpoints: Sequence[str], *, insecure: bool) -> None:
    """Refuse to listen beyond loopback without access control, unless `insecure`. Raises AccessError."""
    if insecure:
        return
    open_to_all = [f"api = {api_host}"] if not is_loopback(api_host) else []
    open_to_all += [f"link = {endpoint}" for endpoint in endpoints if not is_local(endpoint)]
    if open_to_all:
        raise AccessError(
            f"{' and '.join(open_to_all)} would listen beyond this machine without access control; "
            "choose a loopback address, or set insecure (--insecure, COVISTA_INSECURE=true)"
        )


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

"""How often an address may fail: a bucket for each, and not more addresses than there is room for."""

from __future__ import annotations

import math
import time
from collections import OrderedDict
from collections.abc import Callable
from ipaddress import IPv6Address, ip_address

_IPV6_NETWORK_BITS = 64


class Attempts:
    """`most` failures a minute, for each address; of too many addresses those that failed longest ago are forgotten."""

    def __init__(self, most: int = 10, *, addresses: int = 4096, clock: Callable[[], float] = time.monotonic) -> None:
        self._most = most
        self._addresses = addresses
        self._clock = clock
        # How much of the bucket is used up, and as of when.
        self._used: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def __len__(self) -> int:
        return len(self._used)

    def fail(self, address: str) -> int:
        """Note a failure: 0, or the seconds after which the next one is taken, where there were too many."""
        key, now_s = client_of(address), self._clock()
        used, since_s = self._used.get(key, (0.0, now_s))
        used = max(0.0, used - (now_s - since_s) * self._most / 60)
        over = used + 1 - self._most
        # One that is turned away does not put off the next.
        self._used[key] = (used if over > 0 else used + 1, now_s)
        self._used.move_to_end(key)
        while len(self._used) > self._addresses:
            self._used.popitem(last=False)
        return math.ceil(over * 60 / self._most) if over > 0 else 0


def client_of(address: str) -> str:
    """Who is behind an address: of IPv6 a network of /64, for that is what one client has."""
    try:
        parsed = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if not isinstance(parsed, IPv6Address):
        return str(parsed)
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    network = int(parsed) >> (128 - _IPV6_NETWORK_BITS) << (128 - _IPV6_NETWORK_BITS)
    return f"{IPv6Address(network)}/{_IPV6_NETWORK_BITS}"

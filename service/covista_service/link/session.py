"""The station's zenoh session: a router of its own, which rovers connect to and which may join other routers.

Where it is not to listen it is a client of a router. (As a router beside that one it now and then lost what robots sent
right after the two had found each other.)
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import zenoh
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import config
from covista_schemas.zenoh_tls import Tls

# Bursts may wait so long for a link that is busy. One on which a message was dropped is not waited for again until it
# moves.
WAIT_US = 50_000
# Links at once: of all robots that a list may have, and of a thousand others who watch, join or are strangers. Zenoh's
# own bound is 1000.
MAX_SESSIONS = 11_000
_DROP = "transport/link/tx/queue/congestion_control/drop"

# zenoh's messages end in places of its own source code.
_PLACE = re.compile(r" at /\S+|[\[\]]")


def try_certificates(tls: Tls) -> None:
    """Have zenoh take certificates up, where nobody knows of it: it takes fewer kinds of keys than OpenSSL.

    Raises LinkError.
    """
    try:
        zenoh.open(config("router", listen=["tls/127.0.0.1:0"], tls=tls)).close()
    except zenoh.ZError as error:
        raise LinkError(f"zenoh does not take {tls.cert} and {tls.key}: {_PLACE.sub('', str(error))}") from error


def open_session(
    listen: Sequence[str],
    connect: Sequence[str],
    tls: Tls | None = None,
    access: Mapping[str, Any] | None = None,
) -> zenoh.Session:
    """Listen and join; `access` is who may do what (see `rules`), None for everybody everything.

    Who listens looks for routers that are not there yet until they are; who does not needs one now. Raises LinkError,
    whose text names the end points and the flag to change them.
    """
    made = config("router" if listen else "client", listen=listen, connect=connect, tls=tls)
    if listen:
        made.insert_json5("transport/unicast/max_sessions", str(MAX_SESSIONS))
    if access is not None:
        made.insert_json5("access_control", json.dumps(access))
    made.insert_json5(f"{_DROP}/wait_before_drop", str(WAIT_US))
    made.insert_json5(f"{_DROP}/max_wait_before_drop_fragments", str(2 * WAIT_US))
    try:
        return zenoh.open(made)
    except zenoh.ZError as error:
        if not listen:
            raise LinkError("no router answers") from error
        reason = _PLACE.sub("", str(error))
        raise LinkError(
            f"cannot listen on {', '.join(listen)}: {reason}; choose another end point with --link (COVISTA_LINK)"
        ) from error

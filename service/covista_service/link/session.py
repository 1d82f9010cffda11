"""The station's zenoh session: a router of its own, which rovers connect to and which may join other routers."""

from __future__ import annotations

import re
from collections.abc import Sequence

import zenoh
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import config

# zenoh's messages end in places of its own source code.
_PLACE = re.compile(r" at /\S+|[\[\]]")


def open_session(listen: Sequence[str], connect: Sequence[str]) -> zenoh.Session:
    """Listen and join. Raises LinkError, whose text names the end points and the flag to change them."""
    made = config("router", listen=listen, connect=connect)
    try:
        return zenoh.open(made)
    except zenoh.ZError as error:
        reason = _PLACE.sub("", str(error))
        raise LinkError(
            f"cannot listen on {', '.join(listen)}: {reason}; choose another end point with --link (COVISTA_LINK)"
        ) from error

"""HTTP to one station: what is safe to ask again is asked again, and what goes wrong is an ApiError."""

from __future__ import annotations

import logging
import random
import ssl
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import httpx
from covista_schemas.errors import ApiError

from covista_clients.mission_control.refusals import refusal, retry_after_s

logger = logging.getLogger(__name__)

ATTEMPTS = 4
_FIRST_PAUSE_S = 0.1
# What a proxy or a station that is starting or busy answers, and will not for long.
TRANSIENT = frozenset({502, 503, 504})
# Shorter than servers keep a silent connection: what must not be sent twice had better not meet a closed one.
_KEEP_ALIVE_S = 2.0
_SAFE = frozenset({"GET", "HEAD"})
_BROKEN = (httpx.NetworkError, httpx.TimeoutException, httpx.RemoteProtocolError)
# By these nothing has reached the station.
_NOT_BEGUN = (httpx.ConnectError, httpx.ConnectTimeout)

Parameters = Mapping[str, str | int | float | list[str] | None]


class Connection:
    """Sends requests, within `timeout_s` each, repeats included."""

    def __init__(
        self,
        url: str,
        token: str | None,
        *,
        timeout_s: float,
        verify: str | Path | bool,
        transport: httpx.BaseTransport | None,
    ) -> None:
        """Raises ApiError for an address, a token or a file of certificates that cannot be used."""
        given = (token or "").strip()
        if not (given.isascii() and given.isprintable()):
            # Nothing of it is told: what is said of a header that cannot be sent would have all of it.
            raise ApiError("the token holds what no token holds", detail="only printable ASCII can be sent")
        headers = {"Authorization": f"Bearer {given}"} if given else {}
        trust = _trust(verify)
        try:
            self._client = httpx.Client(
                base_url=url,
                headers=headers,
                timeout=timeout_s,
                transport=transport,
                verify=trust,
                limits=httpx.Limits(keepalive_expiry=_KEEP_ALIVE_S),
            )
        except httpx.InvalidURL as error:
            raise ApiError(f"{url!r} is not a URL", detail=str(error)) from error
        self.timeout_s = timeout_s
        self.closed = threading.Event()

    def get(
        self,
        path: str,
        parameters: Parameters | None = None,
        *,
        headers: Mapping[str, str] | None = None,
        well: tuple[int, ...] = (200,),
    ) -> httpx.Response:
        """The answer, with a status that is `well`. Raises ApiError."""
        given = {key: value for key, value in (parameters or {}).items() if value is not None}
        return self._send("GET", path, well, params=given, headers=headers)

    def change(self, method: str, path: str, body: object = None, *, well: int = 200) -> httpx.Response:
        """Ask for a change, once: whoever gets no answer cannot know whether it was made. Raises ApiError."""
        return self._send(method, path, (well,), json=body)

    def compute(self, path: str, body: object) -> httpx.Response:
        """Ask with a body what changes nothing. Raises ApiError."""
        return self._send("POST", path, (200,), repeat=_NOT_BEGUN, json=body)

    def open_stream(self, path: str, headers: Mapping[str, str], quiet_s: float) -> httpx.Response:
        """An answer without end, to be closed by whoever asked; broken off after `quiet_s` of silence.

        Asked for once. Raises httpx.HTTPError, or ApiError where the station refuses.
        """
        timeout = httpx.Timeout(self.timeout_s, read=quiet_s)
        response = self._client.send(
            self._client.build_request("GET", path, headers=dict(headers), timeout=timeout), stream=True
        )
        if response.status_code == 200:
            return response
        try:
            response.read()
        finally:
            response.close()
        raise refusal(response)

    def no_answer(self, error: Exception) -> ApiError:
        """The error for a station that could not be asked."""
        return ApiError(f"no answer from {self._client.base_url}", detail=str(error) or type(error).__name__)

    def close(self) -> None:
        """Close what is open, and end waiting."""
        self.closed.set()
        self._client.close()

    def _send(
        self,
        method: str,
        path: str,
        well: tuple[int, ...],
        *,
        repeat: tuple[type[httpx.TransportError], ...] | None = None,
        **request: Any,
    ) -> httpx.Response:
        deadline_s = time.monotonic() + self.timeout_s
        safe = method in _SAFE
        repeated = repeat if repeat is not None else (_BROKEN if safe else ())
        for attempt in range(ATTEMPTS):
            left_s = max(0.01, deadline_s - time.monotonic())
            try:
                response = self._client.request(method, path, timeout=left_s, **request)
            except (httpx.HTTPError, httpx.InvalidURL) as error:
                if not (isinstance(error, repeated) and self._pause(attempt, deadline_s)):
                    raise self.no_answer(error) from error
                logger.debug("%s %s again: %r", method, path, error)
            else:
                if response.status_code in well:
                    return response
                again = safe and response.status_code in TRANSIENT
                if not (again and self._pause(attempt, deadline_s, retry_after_s(response))):
                    raise refusal(response)
                logger.debug("%s %s again: status %d", method, path, response.status_code)
        raise AssertionError("the last attempt returns or raises")

    def _pause(self, attempt: int, deadline_s: float, asked_s: float | None = None) -> bool:
        """Wait before the next attempt, as long as the station asked for; False where there should be none."""
        pause_s = _FIRST_PAUSE_S * 2**attempt * random.uniform(0.5, 1.0) if asked_s is None else asked_s
        if attempt + 1 == ATTEMPTS or time.monotonic() + pause_s >= deadline_s:
            return False
        return not self.closed.wait(pause_s)


def _trust(verify: str | Path | bool) -> ssl.SSLContext | bool:
    if isinstance(verify, bool):
        return verify
    try:
        return ssl.create_default_context(cafile=verify)
    except (OSError, ssl.SSLError) as error:
        raise ApiError(f"{verify} cannot be used as certificates of authorities", detail=str(error)) from error

"""Logging in: a form that sends a token, for which the browser gets a session's cookie. Works without scripts."""

from __future__ import annotations

import re
from html import escape
from http import HTTPStatus
from urllib.parse import parse_qs

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from covista_service.access import Door, Refusal, Refused
from covista_service.access.sessions import COOKIE
from covista_service.access.tokens import is_shaped
from covista_service.dashboard.places import LOG_IN, PREFIX, REFERRER
from covista_service.dashboard.sources import SourcesNow

router = APIRouter(include_in_schema=False)
# Back to one of our own pages and nowhere else.
_OWN = re.compile(r"/[A-Za-z0-9_./?=&%:+-]{0,500}")
_POLICY = (
    "default-src 'none'; style-src 'self'; img-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)
_WHY = {
    Refusal.UNKNOWN: "The station does not know this token.",
    Refusal.REVOKED: "This token is revoked.",
    Refusal.MALFORMED: "That is no token: one looks like covista_ and 43 more characters.",
    Refusal.MISSING: "That is no token: one looks like covista_ and 43 more characters.",
    Refusal.SCOPE: "This token allows nothing here.",
    Refusal.LIMITED: "Too many wrong tokens came from there. Try again in {seconds} s.",
    Refusal.UNREAD: "The station cannot read its tokens now. Try again in a moment.",
}
_STATUS = {
    Refusal.SCOPE: HTTPStatus.FORBIDDEN,
    Refusal.LIMITED: HTTPStatus.TOO_MANY_REQUESTS,
    Refusal.UNREAD: HTTPStatus.SERVICE_UNAVAILABLE,
}
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>Log in - Covista</title>
<link rel="icon" href="{root}{prefix}/files/icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="{root}{prefix}/files/log_in.css"></head><body><main>
<h1>Covista</h1>
<p>This station asks for a token. Whoever operates it makes one with <code>covista-station token add NAME</code>.</p>
{problem}<form method="post" action="{root}{prefix}/session">
<input type="hidden" name="next" value="{back}">
<label for="token">Token</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus spellcheck="false">
<button type="submit">Log in</button></form></main></body></html>"""


@router.get(LOG_IN)
async def page(request: Request, sources: SourcesNow) -> Response:
    """The form; where nobody needs to log in, the page that was wanted."""
    back = _own(request.query_params.get("next", "/"))
    if sources.gate.keyring.door is Door.OPEN:
        return _sent_on(request, back)
    return _form(request, back)


@router.post("/session")
async def log_in(request: Request, sources: SourcesNow) -> Response:
    """A session for the token in the form; back to the form, with a word, where it is not good."""
    fields = parse_qs((await request.body()).decode(errors="replace"))
    token, back = fields.get("token", [""])[0].strip(), _own(fields.get("next", ["/"])[0])
    address = request.client.host if request.client else ""
    found = await sources.gate.log_in(token, address)
    if isinstance(found, Refused):
        return _form(request, back, _words(found, token), found)
    # Who logs in anew leaves nothing behind.
    sources.gate.sessions.end(request.cookies.get(COOKIE, ""))
    response = _sent_on(request, back)
    if found:
        # A proxy may speak TLS for the station: the browser says where it thinks it is.
        secure = request.url.scheme == "https" or request.headers.get("origin", "").startswith("https://")
        response.set_cookie(COOKIE, found, httponly=True, samesite="lax", secure=secure, path=_root(request) or "/")
    return response


@router.post("/session/end")
async def log_out(request: Request, sources: SourcesNow) -> Response:
    """End the session; to the form."""
    sources.gate.sessions.end(request.cookies.get(COOKIE, ""))
    response = _sent_on(request, LOG_IN)
    response.delete_cookie(COOKIE, path=_root(request) or "/")
    return response


def _words(refused: Refused, token: str) -> str:
    """Why not, and what to do."""
    misspelt = refused.reason is Refusal.UNKNOWN and not is_shaped(token)
    words = _WHY.get(Refusal.MALFORMED if misspelt else refused.reason, "The station does not let you in.")
    return words.format(seconds=refused.retry_after_s)


def _own(path: str) -> str:
    """The page to go to, below the prefix; the first one for what is none of ours."""
    return path if _OWN.fullmatch(path) and "//" not in path else "/"


def _root(request: Request) -> str:
    return str(request.scope.get("root_path", ""))


def _sent_on(request: Request, path: str) -> Response:
    return RedirectResponse(f"{_root(request)}{PREFIX}{path}", HTTPStatus.SEE_OTHER)


def _form(request: Request, back: str, problem: str = "", refused: Refused | None = None) -> Response:
    words = f'<p role="alert">{escape(problem)}</p>\n' if problem else ""
    text = _PAGE.format(root=escape(_root(request)), prefix=PREFIX, problem=words, back=escape(back))
    headers = {"content-security-policy": _POLICY, "referrer-policy": REFERRER}
    if refused is None:
        return HTMLResponse(text, HTTPStatus.OK, headers)
    if refused.retry_after_s:
        headers["retry-after"] = str(refused.retry_after_s)
    return HTMLResponse(text, _STATUS.get(refused.reason, HTTPStatus.UNAUTHORIZED), headers)

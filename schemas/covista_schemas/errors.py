"""The exceptions of Covista's schemas and clients.

CovistaError
├── KeyExpressionError      a key expression that is not one of ours
├── DecodeError             a payload of which one field is wrong; says which and why
├── MissingExtraError       a command or a call needs an optional package that is not installed
├── LinkError               the zenoh network could not be reached or used
└── ApiError                the station's REST interface answered with a problem, or not at all
    ├── UnauthorizedError   it wants a token, and there was none or one that it does not know
    ├── ForbiddenError      the token's scopes do not reach so far
    └── TooManyError        it has had too many questions (or wrong tokens) from here, for now
"""

from __future__ import annotations


class CovistaError(Exception):
    """What all errors of Covista have in common; the text is fit for a person."""


class KeyExpressionError(CovistaError, ValueError):
    """A key expression that is not one of Covista's."""


class DecodeError(CovistaError, ValueError):
    """A payload that cannot be used, because of one field.

    `code` is a short name from a closed list (see `codec`), fit for counting; `field` names the wire's field;
    `reason` says what was found and what was expected.
    """

    def __init__(self, code: str, field: str, reason: str) -> None:
        super().__init__(f"{field}: {reason}")
        self.code = code
        self.field = field
        self.reason = reason

    def __reduce__(self) -> tuple[type[DecodeError], tuple[str, str, str]]:
        """Cross process borders whole: the default would call the constructor with the text alone."""
        return (DecodeError, (self.code, self.field, self.reason))


class MissingExtraError(CovistaError, ImportError):
    """A package of an optional extra is absent; the text says what to install."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional extra: pip install 'covista[{extra}]'")
        self.extra = extra


class LinkError(CovistaError, ConnectionError):
    """The zenoh network could not be reached or used."""


class ApiError(CovistaError):
    """The station's REST interface answered with a problem, or could not be reached.

    `status` is the HTTP status, or None where there was no answer; `retry_after_s` says when to try again, where the
    station said so.
    """

    retry_after_s: float | None = None

    def __init__(self, title: str, *, status: int | None = None, detail: str | None = None) -> None:
        super().__init__(title if not detail else f"{title}: {detail}")
        self.title = title
        self.status = status
        self.detail = detail


class UnauthorizedError(ApiError):
    """The station wants a token: there was none, or one that it does not know (any more)."""


class ForbiddenError(ApiError):
    """The station knows the token, and its scopes do not reach so far."""


class TooManyError(ApiError):
    """Too much was asked from here, or with wrong tokens, for now."""

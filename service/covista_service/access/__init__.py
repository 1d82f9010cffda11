"""Who may listen and who may ask: tokens, what each of them allows, and how long anybody may guess."""

from __future__ import annotations

from covista_service.access.attempts import Attempts
from covista_service.access.gate import Admitted, Gate, Refusal, Refused
from covista_service.access.keyring import Door, Keyring
from covista_service.access.listening import AccessError, check_listening, is_local, is_loopback, warn_of_open_doors
from covista_service.access.pages import Pages
from covista_service.access.scopes import Scope
from covista_service.access.tokens import Token, TokenError, TokenSource
from covista_service.access.watch import TokenWatch

__all__ = [
    "AccessError",
    "Admitted",
    "Attempts",
    "Door",
    "Gate",
    "Keyring",
    "Pages",
    "Refusal",
    "Refused",
    "Scope",
    "Token",
    "TokenError",
    "TokenSource",
    "TokenWatch",
    "check_listening",
    "is_local",
    "is_loopback",
    "warn_of_open_doors",
]

"""The settings of the station: flags > environment (COVISTA_*) > given while it ran > file (TOML) > defaults."""

from __future__ import annotations

import logging
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self
from urllib.parse import urlsplit

from covista_schemas.errors import CovistaError, LinkError
from covista_schemas.keys import ID_PATTERN
from covista_schemas.settings import Hysteresis, LiveSettings, Patch, patched
from covista_schemas.zenoh_config import check_endpoint, check_transport
from covista_schemas.zenoh_tls import Tls
from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, ValidationError, model_validator
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    InitSettingsSource,
    NoDecode,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

log = logging.getLogger(__name__)

PREFIX = "COVISTA_"
# Settings that are flags of `serve` too.
FLAGS = (
    "api",
    "link",
    "connect",
    "database",
    "workers",
    "insecure",
    "zenoh_tls_ca",
    "zenoh_tls_cert",
    "zenoh_tls_key",
    "zenoh_tls_robots",
)
_ZENOH_TLS = ("zenoh_tls_ca", "zenoh_tls_cert", "zenoh_tls_key")
# What pydantic-settings says of a variable that has several values and is not JSON.
_UNREAD = r'error parsing value for field "(\w+)" from source'


class SettingsError(CovistaError):
    """Settings that make no sense; the text is one line that names the setting and what is allowed."""


class Address(NamedTuple):
    """Where to listen."""

    host: str
    port: int


def flag_of(name: str) -> str:
    """The flag of a setting that has one."""
    return f"--{name.replace('_', '-')}"


def without_options(endpoints: Iterable[str]) -> tuple[str, ...]:
    """Zenoh end points as others may see them: what configures one may be a private key."""
    return tuple(endpoint.split("#")[0] for endpoint in endpoints)


def parse_address(text: str) -> Address:
    """HOST:PORT or [IPv6]:PORT as an Address; raises ValueError."""
    host, colon, port = text.rpartition(":")
    if not (colon and host and port.isascii() and port.isdigit() and int(port) < 65_536):
        raise ValueError(f"{text!r} is not HOST:PORT with a port from 0 to 65535")
    return Address(host.removeprefix("[").removesuffix("]"), int(port))


def _check_address(text: str) -> str:
    parse_address(text)
    return text


def _check_endpoint(text: str) -> str:
    try:
        return check_endpoint(text)
    except LinkError as error:
        raise ValueError(str(error)) from error


def _check_database(text: str) -> str:
    try:
        make_url(text)
    except (ArgumentError, ValueError) as error:
        raise ValueError("not a database URL such as sqlite:///covista.db") from error
    return text


def _check_workers(text: str) -> str:
    if text in ("threads", "processes"):
        return text
    if not re.fullmatch(r"dask://[^\s/@?#]+:[0-9]{1,5}", text) or parse_address(text.removeprefix("dask://")).port == 0:
        raise ValueError(f"{text!r} is not threads, processes or dask://HOST:PORT")
    return text


def _check_origin(text: str) -> str:
    try:
        parts = urlsplit(text)
        whole = parts.scheme in ("http", "https") and parts.hostname and text == f"{parts.scheme}://{parts.netloc}"
        _ = parts.port
    except ValueError:
        whole = False
    if not whole or "@" in text or "*" in text or text != text.lower():
        raise ValueError(f"{text!r} is not the origin of a page, such as https://control.example:8443")
    return text


def _split(value: object) -> object:
    return [part.strip() for part in value.split(",") if part.strip()] if isinstance(value, str) else value


Endpoints = Annotated[tuple[Annotated[str, AfterValidator(_check_endpoint)], ...], NoDecode, BeforeValidator(_split)]
Origins = Annotated[tuple[Annotated[str, AfterValidator(_check_origin)], ...], NoDecode, BeforeValidator(_split)]
Names = Annotated[tuple[Annotated[str, Field(min_length=1, max_length=200)], ...], NoDecode, BeforeValidator(_split)]
Seconds = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]


class Settings(LiveSettings, BaseSettings):
    """Everything that can be set, flat: the names are the keys of the TOML file and, with COVISTA_, the variables."""

    model_config = SettingsConfigDict(
        env_prefix=PREFIX,
        env_nested_delimiter="__",
        extra="forbid",
        frozen=True,
        env_ignore_empty=True,
        hide_input_in_errors=True,
    )

    api: Annotated[str, AfterValidator(_check_address)] = Field(
        default="127.0.0.1:8000", description="HOST:PORT that the REST interface listens on; port 0 takes a free one."
    )
    link: Endpoints = Field(
        default=("tcp/127.0.0.1:7447",),
        description="zenoh end points to listen on, separated by commas; none by default where connect is set.",
    )
    connect: Endpoints = Field(default=(), description="zenoh routers to join, separated by commas.")
    site: str = Field(default="default", pattern=f"^{ID_PATTERN}$", description="Second chunk of every key expression.")
    database: Annotated[str, AfterValidator(_check_database)] = Field(
        default="sqlite:///covista.db", description="URL of the database for the history."
    )
    retention_days: float = Field(
        default=30, gt=0, le=36_500, allow_inf_nan=False, description="The history is kept for so many days."
    )
    retention_mb: float = Field(
        default=1024,
        ge=8,
        le=1e9,
        allow_inf_nan=False,
        description="The database takes at most so many MB (1e6 bytes): when it would take more, the oldest goes.",
    )
    workers: Annotated[str, AfterValidator(_check_workers)] = Field(
        default="threads", description="Where surveys run: threads, processes, or a cluster as dask://HOST:PORT."
    )
    workers_count: int = Field(
        default=2, ge=1, le=256, description="How many surveys run at a time; of a cluster, while it is away."
    )
    insecure: bool = Field(default=False, description="Listen beyond loopback without access control.")
    cors_origins: Origins = Field(
        default=(), description="Origins whose pages may ask the REST interface in a browser, separated by commas."
    )
    tls_cert: Path | None = Field(default=None, description="PEM file with the REST interface's certificate and chain.")
    tls_key: Path | None = Field(default=None, description="PEM file with the key of tls_cert, without a password.")
    zenoh_tls_ca: Path | None = Field(
        default=None, description="PEM file with the authority of all certificates on zenoh, the robots' and our own."
    )
    zenoh_tls_cert: Path | None = Field(default=None, description="PEM file with the certificate shown on zenoh.")
    zenoh_tls_key: Path | None = Field(
        default=None, description="PEM file with the key of zenoh_tls_cert, without a password."
    )
    zenoh_tls_robots: Path | None = Field(
        default=None,
        description="File with the ids of the robots that are let in on zenoh, one a line; # for comments.",
    )
    zenoh_tls_peers: Names = Field(
        default=(),
        description="Common names of certificates that may do all on zenoh besides our own, separated by commas.",
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="Least level to log.")
    log_format: Literal["text", "json"] = Field(default="text", description="A line of words, or a JSON object.")
    log_lines_per_minute: int = Field(
        default=60, ge=0, le=1_000_000, description="Lines of one kind a minute; 0 for no limit."
    )
    live_after_s: Seconds = Field(default=5, description="A robot is live so long after its last message.")
    gone_after_s: Seconds = Field(default=30, description="A stale robot is gone after so much more silence.")
    forget_after_s: Seconds = Field(default=600, description="A robot is forgotten after this silence.")
    decay_after_s: Seconds = Field(default=60, description="An overlap decays when it is older than this.")
    unknown_after_s: Seconds = Field(default=600, description="An overlap is unknown when it is older than this.")
    retry_after_s: Seconds = Field(default=30, description="No pair whose views cannot meet is tried again sooner.")

    # Names of live settings, with a dot before parts, that came with flags or from the environment.
    _pinned: frozenset[str] = PrivateAttr(default=frozenset())

    @property
    def pinned(self) -> frozenset[str]:
        """Live settings, or parts such as hysteresis.gain, that flags or the environment say: nothing stored does."""
        return self._pinned

    @property
    def api_address(self) -> Address:
        """Where the REST interface listens."""
        return parse_address(self.api)

    @property
    def shown(self) -> dict[str, str]:
        """All settings as words that may stand in a log: without passwords."""
        shown = {name: str(getattr(self, name)) for name in type(self).model_fields}
        # What is asked of a database, or configures an end point, may hold a key.
        shown["database"] = make_url(self.database).set(query={}).render_as_string(hide_password=True)
        shown |= {"link": ", ".join(without_options(self.link)), "connect": ", ".join(without_options(self.connect))}
        shown["zenoh_tls_peers"] = ", ".join(self.zenoh_tls_peers)
        shown["cors_origins"] = ", ".join(self.cors_origins)
        return shown

    @property
    def live(self) -> LiveSettings:
        """Those settings that can change while the station runs."""
        return LiveSettings.model_validate({name: getattr(self, name) for name in LiveSettings.model_fields})

    @property
    def zenoh_tls(self) -> Tls | None:
        """The certificates for zenoh, where there are any."""
        if self.zenoh_tls_ca is None or self.zenoh_tls_cert is None or self.zenoh_tls_key is None:
            return None
        return Tls(self.zenoh_tls_ca, self.zenoh_tls_cert, self.zenoh_tls_key)

    @model_validator(mode="before")
    @classmethod
    def _join_only(cls, given: object) -> object:
        """Who joins a router listens where told to, and nowhere else."""
        if isinstance(given, dict) and given.get("connect") and "link" not in given:
            return {**given, "link": ()}
        return given

    @model_validator(mode="after")
    def _check_zenoh_tls(self) -> Self:
        files = {name: getattr(self, name) for name in _ZENOH_TLS}
        absent = [name for name, file in files.items() if file is None]
        if 0 < len(absent) < len(files):
            given = ", ".join(name for name in files if name not in absent)
            raise ValueError(
                f"setting {given} needs {', '.join(absent)}: zenoh takes an authority, a certificate, a key"
            )
        if absent and (self.zenoh_tls_robots is not None or self.zenoh_tls_peers):
            name = "zenoh_tls_peers" if self.zenoh_tls_robots is None else "zenoh_tls_robots"
            raise ValueError(f"setting {name} needs {', '.join(absent)}: without certificates nobody is known")
        for name, endpoints in (("link", self.link), ("connect", self.connect)):
            self._check_transports(name, endpoints, locked=not absent)
        if not absent and self.link and self.zenoh_tls_robots is None:
            raise ValueError("setting zenoh_tls_ca needs zenoh_tls_robots: without a list no robot would be let in")
        return self

    @staticmethod
    def _check_transports(name: str, endpoints: tuple[str, ...], *, locked: bool) -> None:
        for endpoint in endpoints:
            try:
                check_transport(endpoint, locked)
            except LinkError as error:
                raise ValueError(
                    f"setting {name} (--{name}, {PREFIX}{name.upper()}): {error} ({', '.join(_ZENOH_TLS)})"
                ) from error

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.decay_after_s > self.unknown_after_s:
            raise ValueError(
                f"setting decay_after_s = {self.decay_after_s:g} must not be more than "
                f"unknown_after_s = {self.unknown_after_s:g}"
            )
        if self.live_after_s + self.gone_after_s > self.forget_after_s:
            raise ValueError(
                f"setting forget_after_s = {self.forget_after_s:g} must not be less than live_after_s + gone_after_s "
                f"= {self.live_after_s + self.gone_after_s:g}"
            )
        if (self.tls_cert is None) != (self.tls_key is None):
            given, absent = ("tls_cert", "tls_key") if self.tls_key is None else ("tls_key", "tls_cert")
            raise ValueError(f"setting {given} needs {absent}: TLS takes a certificate and its key")
        if not self.link and not self.connect:
            raise ValueError("setting link is empty, and so is connect: no robot could reach the station")
        return self


def load(flags: Mapping[str, object] | None = None, file: Path | None = None) -> Settings:
    """Settings from `flags`, the environment and a TOML `file`. Raises SettingsError."""
    stored = _read(file) if file else {}

    class Layered(Settings):
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: PydanticBaseSettingsSource,
            env_settings: PydanticBaseSettingsSource,
            dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003 - pydantic-settings passes it by name
            file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003 - pydantic-settings passes it by name
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            return init_settings, env_settings, InitSettingsSource(settings_cls, stored)

    try:
        layered = Layered.model_validate(dict(flags or {}))
    except ValidationError as error:
        raise SettingsError(_one_line(error)) from error
    # A class that every process can import, for settings that travel to one.
    settings = Settings.model_construct(**dict(layered))
    settings._pinned = _names(flags or {}) | _names(EnvSettingsSource(Settings)())
    return settings


def with_stored(settings: Settings, stored: Patch) -> Settings:
    """The settings with those laid over that were given while the station ran, but for what is pinned.

    What makes no sense any more is left out, with a warning.
    """
    live = settings.live
    for name, value in stored.items():
        if name in settings.pinned or name.partition(".")[0] in settings.pinned:
            continue
        try:
            live = patched(live, {name: value})
        except ValidationError:
            log.warning("a stored setting makes no sense any more and is left out: %s", name)
    found = settings.model_copy(update={name: getattr(live, name) for name in LiveSettings.model_fields})
    found._pinned = settings.pinned
    return found


def _names(values: Mapping[str, object]) -> frozenset[str]:
    """Names of the live settings among them; parts of the hysteresis by themselves."""
    parts = values.get("hysteresis")
    whole = {name for name in LiveSettings.model_fields if name in values}
    if isinstance(parts, Mapping):
        whole = whole - {"hysteresis"} | {f"hysteresis.{part}" for part in parts}
    return frozenset(whole)


def _read(file: Path) -> dict[str, object]:
    try:
        return tomllib.loads(file.read_text("utf-8"))
    except OSError as error:
        raise SettingsError(f"--config {file} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsError(f"--config {file} is not TOML: {error}") from error


def _one_line(error: ValidationError) -> str:
    """The first wrong setting, what is wrong with it, and what is allowed."""
    found = error.errors(include_url=False)
    if not found[0]["loc"]:
        said = found[0]["msg"].removeprefix("Value error, ")
        unread = re.match(_UNREAD, said)
        if unread is None:
            return said
        variable = PREFIX + unread[1].upper()
        return f"setting {unread[1]} ({variable}): not JSON; or set a part of it, as {variable}__NAME"
    name = str(found[0]["loc"][0])
    known = Settings.model_fields
    if name not in known:
        return f"setting {name} is not known; known are {', '.join(known)}"
    reasons = dict.fromkeys(each["msg"].removeprefix("Value error, ") for each in found if each["loc"][0] == name)
    flag = f"{flag_of(name)}, " if name in FLAGS else ""
    variable, description = PREFIX + name.upper(), known[name].description
    inner = found[0]["loc"][1:]
    if known[name].annotation is Hysteresis and inner:
        part = str(inner[0])
        name, variable = f"{name}.{part}", f"{variable}__{part.upper()}"
        held = Hysteresis.model_fields.get(part)
        description = held.description if held else f"Known are {', '.join(Hysteresis.model_fields)}."
    return f"setting {name} ({flag}{variable}): {'; or '.join(reasons)}. {description}"

"""The setting that names a Dask scheduler."""

from __future__ import annotations

from importlib.util import find_spec

from covista_schemas.errors import MissingExtraError

SCHEME = "dask://"


def scheduler_of(kind: str) -> str | None:
    """HOST:PORT of `dask://HOST:PORT`; None if it is no such URL."""
    return kind.removeprefix(SCHEME) if kind.startswith(SCHEME) else None


def check_kind(kind: str) -> None:
    """Raises MissingExtraError for a cluster where Dask is absent."""
    if scheduler_of(kind) is not None and find_spec("distributed") is None:
        raise MissingExtraError(f"workers = {kind}", "scale")

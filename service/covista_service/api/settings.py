"""The settings that can change while the station runs."""

from __future__ import annotations

import asyncio
import logging
from typing import Annotated, Any

from covista_schemas.settings import LiveSettings, Patch, SettingsPatch, flat, patched
from fastapi import APIRouter, Body, Response
from pydantic import ValidationError

from covista_service import answers
from covista_service.api import examples
from covista_service.api.deps import AskerNow, PartsNow, SnapshotNow, answer
from covista_service.api.errors import ContradictionError, describe
from covista_service.station.events import SettingsGiven
from covista_service.station.options import GroupingOptions
from covista_service.station.snapshot import Snapshot

router = APIRouter(prefix="/settings", tags=["settings"])
PatchBody = Annotated[
    SettingsPatch, Body(description="The settings that are to be others.", openapi_examples=examples.PATCHES)
]
# What every route with a body may answer.
BODY_PROBLEMS: dict[int | str, dict[str, Any]] = describe(400, 409, 503)
# The answer waits so long for the history to have it.
_FLUSH_S = 1.0

log = logging.getLogger(__name__)


def options_with(snapshot: Snapshot, patch: SettingsPatch) -> GroupingOptions:
    """The options in force with a patch laid over them."""
    live = answers.live_settings(snapshot.groups.settings)
    return answers.grouping_options(_laid_over(live, flat(patch)))


def _laid_over(live: LiveSettings, asked: Patch) -> LiveSettings:
    """The settings with others. Raises ContradictionError."""
    try:
        return patched(live, asked)
    except ValidationError as error:
        reasons = dict.fromkeys(each["msg"].removeprefix("Value error, ") for each in error.errors())
        raise ContradictionError(f"{', '.join(asked)}: {'; or '.join(reasons)}") from error


@router.get("", response_model=LiveSettings, responses=examples.show(examples.SETTINGS))
async def settings(snapshot: SnapshotNow) -> Response:
    """The settings in force."""
    return answer(answers.live_settings(snapshot.groups.settings))


@router.patch("", response_model=LiveSettings, responses={**examples.show(examples.SETTINGS), **BODY_PROBLEMS})
async def patch_settings(patch: PatchBody, parts: PartsNow, by: AskerNow) -> Response:
    """Change settings at once, those that the body names; the answer is all that are in force then.

    They hold after a restart too, unless a flag or a variable of the environment says otherwise, and an event says who
    has changed what. What so many robots cannot keep, such as more groups than robots, is loosened, and the groups'
    `note` says so. An empty body changes nothing.
    """
    asked = flat(patch)
    async with parts.setting:
        before = answers.live_settings(parts.loop.snapshot().groups.settings)
        if not asked:
            return answer(before)
        after = _laid_over(before, asked)
        text = answers.changes(before, after)
        await parts.loop.do(SettingsGiven(answers.grouping_options(after), text, by, asked))
        now = answers.live_settings(parts.loop.snapshot().groups.settings)
    if not await asyncio.to_thread(parts.flush, _FLUSH_S):
        log.warning("settings have changed and are not in the history yet: a restart now would forget them")
    return answer(now)

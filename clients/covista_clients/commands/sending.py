"""One keyframe by hand."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
import zenoh
from covista_schemas.errors import CovistaError, LinkError
from covista_schemas.messages import Camera, Pose
from covista_schemas.reports import KeyframeId, RobotReport
from covista_schemas.zenoh_config import config
from pydantic import ValidationError

from covista_clients.commands.options import DEFAULT_CONNECT, Connect, Site, TlsCa, TlsCert, TlsKey, certificates
from covista_clients.rover import Rover
from covista_clients.rover.link import ask_report, nobody_answers, nobody_listens, warn_of_another_name

_ASK_EVERY_S = 0.05


def send(
    image: Annotated[Path, typer.Argument(help="JPEG, PNG or WebP file.")],
    robot: Annotated[str, typer.Option(help="Id of the robot that took it.")],
    camera: Annotated[
        Path,
        typer.Option(help="JSON file with fx, fy, cx, cy, width, height, perhaps distortion {model, coefficients}."),
    ],
    pose: Annotated[str, typer.Option(help='"x y z qx qy qz qw": metres, and the unit quaternion world_from_camera.')],
    connect: Connect = DEFAULT_CONNECT,
    wait: Annotated[float, typer.Option(min=0, help="Seconds to wait for the station's confirmation.")] = 5.0,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    site: Site = "default",
) -> None:
    """Send one keyframe, and end well when the station has confirmed it."""
    picture, taken_by, taken_from = _read(image), _read_camera(camera), _read_pose(pose)
    tls = certificates(connect, tls_ca, tls_cert, tls_key)
    if tls is not None:
        warn_of_another_name(robot, tls)
    deadline_s = time.monotonic() + wait
    try:
        session = zenoh.open(config("client", connect=[connect], timeout_ms=round(wait * 1000), tls=tls))
    except zenoh.ZError as error:
        why = "" if tls is None else f": {nobody_answers(connect, tls)}"
        raise LinkError(f"no router at {connect} within {wait:g} s{why}") from error
    with session, _left_at_once(_rover(robot, taken_by, site, session)) as rover:
        dropped_before = _dropped(_ask(session, site, robot, deadline_s))
        keyframe = _hand_over(rover, picture, taken_from)
        try:
            _wait_until_in_use(session, rover, keyframe, dropped_before, deadline_s)
        except LinkError as error:
            if tls is None or rover.keyframes_sent:
                raise
            raise LinkError(nobody_listens(robot, tls)) from error
    print(f"{robot}: the station has the keyframe, {keyframe.sequence} of boot {keyframe.boot}")


@contextmanager
def _left_at_once(rover: Rover) -> Iterator[Rover]:
    """By then the station has confirmed the keyframe, or has been waited for."""
    try:
        yield rover
    finally:
        rover.close(wait_s=0)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CovistaError(f"{path} cannot be read: {error.strerror}") from error


def _read_camera(path: Path) -> Camera:
    try:
        return Camera.model_validate_json(_read(path))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "camera"
        raise CovistaError(f"{path}: {where}: {first['msg']}") from error


def _read_pose(text: str) -> Pose:
    try:
        x, y, z, qx, qy, qz, qw = (float(word) for word in text.split())
        return Pose((x, y, z), (qx, qy, qz, qw), time.time_ns())
    except ValueError as error:
        raise CovistaError(f'--pose {text!r} is not "x y z qx qy qz qw": {error}') from error


def _rover(robot: str, camera: Camera, site: str, session: zenoh.Session) -> Rover:
    try:
        return Rover(robot, camera, site=site, session=session, liveliness=False)
    except ValueError as error:
        raise CovistaError(str(error)) from error


def _hand_over(rover: Rover, picture: bytes, pose: Pose) -> KeyframeId:
    try:
        return rover.send_keyframe(picture, pose)
    except ValueError as error:
        raise CovistaError(str(error)) from error


def _ask(session: zenoh.Session, site: str, robot: str, deadline_s: float) -> RobotReport | None:
    return ask_report(session, site, robot, max(0.1, deadline_s - time.monotonic()))


def _dropped(report: RobotReport | None) -> int:
    return 0 if report is None else sum(report.keyframes.dropped.values())


def _wait_until_in_use(
    session: zenoh.Session, rover: Rover, keyframe: KeyframeId, dropped_before: int, deadline_s: float
) -> None:
    """Ask until the station uses the keyframe; CovistaError with its reason where it does not."""
    report, pause = None, threading.Event()
    while time.monotonic() < deadline_s:
        report = _ask(session, rover.site, rover.robot, deadline_s)
        if report is not None and report.keyframe == keyframe:
            return
        if report is not None and _dropped(report) > dropped_before:
            raise CovistaError(f"the station refused it: {report.last_problem}")
        pause.wait(_ASK_EVERY_S)
    if not rover.keyframes_sent:
        raise LinkError("there is a router, but no station that listens to keyframes")
    raise LinkError("sent, but not confirmed in time" if report else "sent, but no station answers")

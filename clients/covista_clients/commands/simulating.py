"""Simulated rovers, and rendered worlds on disk."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from covista_schemas import keys
from covista_schemas.errors import CovistaError, MissingExtraError

from covista_clients.commands.interrupting import ends_by_interrupt
from covista_clients.commands.options import DEFAULT_CONNECT, Connect, Site, TlsCa, TlsCert, TlsKey, certificates
from covista_clients.rover import Send

if TYPE_CHECKING:
    from covista_clients.simulation.accounts import Account
    from covista_clients.simulation.swarm import Progress, SwarmOptions

CROWD_POSE_RATE_HZ = 1.0
WorldName = Annotated[str, typer.Option("--world", help="corner, boxes, shelf, wall or arena.")]


def swarm(
    robots: Annotated[int, typer.Option(min=1, help="How many rovers.")] = 6,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="ID", help="Drive this rover alone; repeatable. Other processes drive the rest."),
    ] = None,
    world: WorldName = "arena",
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same swarm.")] = 0,
    rate: Annotated[float, typer.Option(help="Keyframes per second and rover.")] = 2.0,
    connect: Connect = DEFAULT_CONNECT,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    site: Site = "default",
    send: Annotated[Send, typer.Option(help="What the rovers make of their pictures.")] = Send.IMAGE,
    pose_rate: Annotated[
        float | None, typer.Option(help="Poses per second and rover; 10, or 1 in a crowd.", show_default=False)
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0, help="End after so many seconds; a crowd counts from when it is heard.")
    ] = None,
    clock_offset: Annotated[float, typer.Option(help="Seconds that the rovers' clocks are ahead.")] = 0.0,
    accounts: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="SECONDS",
            help="Write so often, and at the end, what each rover has sent, as JSON; of a crowd at the end.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Drive simulated rovers through a rendered world, until Ctrl-C.

    More than 6 that send features are a crowd: their keyframes are made before they start, 12 for each of 24 robots,
    and up to a thousand robots send them from one process. Each 24 (6 outside of the arena) have a world of their own.

    With --only, processes that are told the same of a swarm drive it together: where it is they know by the clock.

    In the names of --tls-cert and --tls-key {robot} stands for each robot's id; a crowd shares one certificate.
    """
    tls = certificates(connect, tls_ca, tls_cert, tls_key)
    keys.check_id(site, "site")
    with _simulation("covista swarm"):
        from covista_clients.simulation.marching import is_crowd
        from covista_clients.simulation.swarm import SwarmOptions

        options = SwarmOptions(
            robots=robots,
            world=world,
            seed=seed,
            rate_hz=rate,
            connect=connect,
            site=site,
            send=send.value,
            tls=tls,
            clock_offset_s=clock_offset,
            only=tuple(only or ()),
        )
        default_hz = CROWD_POSE_RATE_HZ if is_crowd(options) else options.pose_rate_hz
        options = replace(options, pose_rate_hz=default_hz if pose_rate is None else pose_rate)
    progress = _run(options, seconds, accounts)
    sent = f"{progress.keyframes} keyframes and {progress.poses} poses"
    fates = f"{progress.replaced} of those replaced by newer ones before they went out, {progress.skipped} skipped"
    print(f"{sent}, {fates}, at most {progress.most_behind_s:.2f} s behind", file=sys.stderr)


def render(
    world: Annotated[str, typer.Argument(help="corner, boxes, shelf, wall or arena.")],
    out: Annotated[Path, typer.Option(help="Folder to write into; made if it is not there.", file_okay=False)],
    cameras: Annotated[int, typer.Option(min=1, help="How many views.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same folder.")] = 0,
) -> None:
    """Write views of a rendered world with exact depth and true overlap into a folder."""
    with _simulation("covista render"):
        from covista_clients.simulation import folder, worlds

        folder.write(worlds.build(world, seed), cameras, seed, out)
    print(f"{cameras} views of {world} in {out}", file=sys.stderr)


@contextmanager
def _simulation(command: str) -> Iterator[None]:
    """Say in one line what is wrong with what was asked for, or what to install."""
    try:
        yield
    except ImportError as error:
        if error.name != "cv2":
            raise
        raise MissingExtraError(command, "vision") from error
    except (ValueError, OSError) as error:
        raise CovistaError(str(error)) from error


def _run(options: SwarmOptions, seconds: float | None, accounts: float | None) -> Progress:
    """Run a swarm in a thread of its own, so that Ctrl-C finds the main one waiting and the rovers leave in order."""
    from covista_clients.simulation.accounts import Accountant
    from covista_clients.simulation.marching import is_crowd, run_crowd
    from covista_clients.simulation.swarm import run_swarm

    accountant = None if accounts is None else Accountant(accounts, _tell)
    stop = threading.Event()
    run = partial(run_crowd, on_shot=_show) if is_crowd(options) else run_swarm
    with ThreadPoolExecutor(1, "swarm") as pool:
        running = pool.submit(run, options, stop, seconds=seconds, accountant=accountant)
        with ends_by_interrupt():
            who = f"{', '.join(options.only)} of {options.robots}" if options.only else options.robots
            where = f"{who} rovers in {options.world} send to {options.connect}"
            print(f"{where}; Ctrl-C ends.", file=sys.stderr)
            wait([running])
        stop.set()
        return running.result()


def _tell(account: Account) -> None:
    """One line of JSON."""
    print(json.dumps(asdict(account)), flush=True)


def _show(made: int, count: int) -> None:
    """Tell how many keyframes are made; where lines cannot be replaced, when all are."""
    replaces = sys.stderr.isatty()
    if made == count or replaces:
        start, end = "\r" if replaces else "", "\n" if made == count else ""
        print(f"{start}{made} of {count} keyframes are made", end=end, file=sys.stderr, flush=True)

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from covista_schemas import keys
from covista_schemas.reports import GroupsReport

from tests.clients import sample
from tests.clients.commands.conftest import Run
from tests.clients.ground import DEADLINE_S, SITE, Ground


@contextmanager
def watching(endpoint: str, *options: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "covista_clients", "watch", "--connect", endpoint, *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_groups_are_told_as_they_change_until_terminated(endpoint: str, ground: Ground) -> None:
    ground.publish(keys.groups(SITE), sample.GROUPS)
    with watching(endpoint) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "01:00:00 revision 7  g1: r1 r2 | r3 (no_pose)\n"
        ground.publish(keys.groups(SITE), sample.GROUPS.model_copy(update={"revision": 8, "ungrouped": []}))
        assert process.stdout.readline() == "01:00:00 revision 8  g1: r1 r2\n"
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=DEADLINE_S)
    assert (process.returncode, out) == (0, "")
    assert len(err.splitlines()) == 1


def test_one_report_a_line_for_programs(endpoint: str, ground: Ground) -> None:
    with watching(endpoint, "--format", "json") as process:
        ground.publish(keys.groups(SITE), sample.GROUPS)
        assert process.stdout is not None
        assert GroupsReport.model_validate_json(process.stdout.readline()) == sample.GROUPS


def test_without_a_router_it_waits_and_ends_well(endpoint: str) -> None:
    with watching(endpoint) as process:
        assert process.stderr is not None
        assert "Ctrl-C ends" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=DEADLINE_S) == 0


def test_misuse_is_one_line(run: Run) -> None:
    assert run("watch", "--connect", "nonsense")[::2] == (
        1,
        "covista: 'nonsense' is not an end point such as tcp/127.0.0.1:7447\n",
    )
    assert run("watch", "--site", "no site")[0] == 1

"""A PostgreSQL server of one's own, in a temporary folder, for as long as the tests run."""

import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import psycopg
import pytest
from psycopg import sql

STARTS_S = 60.0


def programs() -> Path | None:
    """Where the server's programs lie."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda each: int(each.parts[-3]))
    if found:
        return found[-1].parent
    anywhere = shutil.which("postgres")
    return Path(anywhere).resolve().parent if anywhere else None


def _nobody() -> dict[str, object]:
    """The server refuses to run as root."""
    if os.geteuid() != 0:
        return {}
    names = {each.pw_name for each in pwd.getpwall()}
    user = pwd.getpwnam("postgres" if "postgres" in names else "nobody")
    return {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}


class Server:
    """A running server, whom tests may stop and let go on."""

    def __init__(self, folder: Path, programs: Path) -> None:
        self._folder = folder
        self._programs = programs
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self._run("initdb", "-D", str(folder / "data"), "-U", "covista", "-A", "trust", "-E", "UTF8", "--no-sync")
        self.start()

    def start(self) -> None:
        arguments = ["-D", self._folder / "data", "-p", str(self.port), "-h", "127.0.0.1", "-k", self._folder, "-F"]
        with (self._folder / "log").open("ab") as log:
            program = self._programs / "postgres"
            self._process = subprocess.Popen(
                [program, *arguments], stdout=log, stderr=log, cwd="/", start_new_session=True, **_nobody()
            )
        ready, pause = [self._programs / "pg_isready", "-q", "-h", "127.0.0.1", "-p", str(self.port)], threading.Event()
        for _ in range(round(STARTS_S / 0.05)):
            if subprocess.run(ready, check=False).returncode == 0:
                return
            pause.wait(0.05)
        raise AssertionError((self._folder / "log").read_text())

    def stop(self) -> None:
        """At once, as by a power cut."""
        self._process.send_signal(signal.SIGQUIT)
        self._process.wait(20)

    def end(self) -> None:
        self._process.send_signal(signal.SIGINT)
        self._process.wait(20)

    @contextmanager
    def frozen(self) -> Iterator[None]:
        """Nobody of it does anything, but its connections stand."""
        # The postmaster first, so that it begins nothing more.
        postmaster = psutil.Process(self._process.pid)
        postmaster.suspend()
        stopped = [postmaster, *postmaster.children(recursive=True)]
        for each in stopped[1:]:
            each.suspend()
        try:
            yield
        finally:
            for each in reversed(stopped):
                each.resume()

    def new_database(self) -> str:
        """The URL of an empty database."""
        name = f"t{secrets.token_hex(6)}"
        with psycopg.connect(host="127.0.0.1", port=self.port, user="covista", dbname="postgres", autocommit=True) as c:
            c.execute(sql.SQL("create database {}").format(sql.Identifier(name)))
        return f"postgresql+psycopg://covista@127.0.0.1:{self.port}/{name}"

    def _run(self, program: str, *arguments: str) -> None:
        done = subprocess.run(
            [self._programs / program, *arguments], check=False, capture_output=True, cwd="/", text=True, **_nobody()
        )
        assert done.returncode == 0, done.stderr


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    found = programs()
    if found is None:
        pytest.skip("no PostgreSQL server is installed here: apt-get install postgresql")
    with tempfile.TemporaryDirectory(prefix="covista-pg-") as name:
        folder = Path(name)
        who = _nobody()
        if who:
            os.chown(folder, who["user"], who["group"])
        folder.chmod(0o700)
        server = Server(folder, found)
        try:
            yield server
        finally:
            server.end()

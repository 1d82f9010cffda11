from collections.abc import Generator, Iterator
from subprocess import CalledProcessError

import pytest

from tests.compose.stack import Stack, engine_answers, of_this_tree

ROBOTS = 3
running = pytest.StashKey[Stack]()


@pytest.fixture(scope="session")
def images() -> None:
    """The images of this tree."""
    if not engine_answers():
        pytest.skip("no Docker engine answers here")
    of_this_tree().run("build", within_s=1200)


@pytest.fixture(scope="session")
def stack(images: None, request: pytest.FixtureRequest) -> Iterator[Stack]:
    """A station and its rovers, started; taken down with their volume whatever happens."""
    deployed = of_this_tree()
    request.config.stash[running] = deployed
    try:
        deployed.start()
        yield deployed
    finally:
        deployed.take_down()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Where a test fails, show what the containers had to say."""
    report = yield
    deployed = item.config.stash.get(running, None)
    if report.failed and deployed is not None:
        try:
            report.sections.append(("Containers", deployed.logs()))
        except CalledProcessError as error:
            report.sections.append(("Containers", f"their logs could not be read: {error}"))
    return report

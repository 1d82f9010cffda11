"""A crew for the loop that works at once."""

from collections.abc import Callable
from concurrent.futures import Future

from covista_service.loop import Built, CrewStatus, Extraction
from covista_service.perception.comparison import Comparison, ComparisonOptions, compare
from covista_service.perception.scene import SceneOptions
from covista_service.station.events import BuildSurfaces, Keyframe, SurveyPair
from covista_service.workers import build

from tests.service.station.scenes import FEATURES


class Hands:
    """A crew that works in the caller's thread, and fails where told to."""

    def __init__(self) -> None:
        self.failure: Exception | None = None
        self.capacity = 2

    def extract(self, keyframe: Keyframe) -> Future[Extraction]:
        return self._done(lambda: (FEATURES, None))

    def survey(self, job: SurveyPair) -> Future[Comparison]:
        return self._done(lambda: compare(job.first_view, job.second_view, ComparisonOptions()))

    def build(self, job: BuildSurfaces) -> Future[Built]:
        return self._done(lambda: build(job.sights, job.thumbnails, job.evidence, SceneOptions()))

    def status(self) -> CrewStatus:
        return CrewStatus("threads", self.capacity)

    def _done(self, work: Callable[[], object]) -> Future:
        future: Future = Future()
        if self.failure is not None:
            future.set_exception(self.failure)
        else:
            future.set_result(work())
        return future

"""A crew for the loop that works at once."""

from collections.abc import Callable
from concurrent.futures import Future

from covista_service.perception.camera import Features
from covista_service.perception.survey import Survey, SurveyOptions, survey
from covista_service.station.events import Keyframe, SurveyPair

from tests.service.station.scenes import FEATURES


class Hands:
    """A crew that works in the caller's thread, and fails where told to."""

    def __init__(self) -> None:
        self.failure: Exception | None = None

    def extract(self, keyframe: Keyframe) -> Future[Features]:
        return self._done(lambda: FEATURES)

    def survey(self, job: SurveyPair) -> Future[Survey]:
        return self._done(lambda: survey(job.first_view, job.second_view, SurveyOptions(), job.prior))

    def _done(self, work: Callable[[], object]) -> Future:
        future: Future = Future()
        if self.failure is not None:
            future.set_exception(self.failure)
        else:
            future.set_result(work())
        return future

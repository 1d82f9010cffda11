"""A keyframe's way into use: it arrives, its features are extracted, and it waits for the one before it."""

from __future__ import annotations

from dataclasses import replace

from covista_service.station.events import Effect, ExtractFeatures, FeaturesExtracted, Keyframe
from covista_service.station.extraction import Extractions
from covista_service.station.roster import Robot, Roster
from covista_service.station.successors import Successors
from covista_service.station.surveys import Surveys


class Keyframes:
    """Sees to it that every keyframe is used or accounted for, the newest of each robot first."""

    def __init__(self, roster: Roster, surveys: Surveys, capacity: int) -> None:
        self._roster = roster
        self._surveys = surveys
        self._extractions = Extractions(capacity)
        self._successors = Successors()

    def enters(self, robot: Robot, keyframe: Keyframe) -> bool:
        """Is a keyframe that has arrived the newest of its robot?"""
        ledger, message = robot.ledgers["keyframe"], (keyframe.id.boot, keyframe.id.sequence)
        if not ledger.take(message):
            return False
        if not robot.enters(keyframe.id.boot, keyframe.arrived_ns) or _older(keyframe, robot.arrived):
            ledger.settle(message, "replaced")
            return False
        robot.arrived = keyframe
        return True

    def take(self, robot: Robot, keyframe: Keyframe) -> list[Effect]:
        """One that has entered is to be used; what is to be done for it."""
        if keyframe.features is None:
            self._replace(self._extractions.wait(keyframe))
        else:
            self._replace(self._extractions.withdraw(robot.id))
            self._succeed(robot, keyframe)
        return self.start()

    def extracted(self, event: FeaturesExtracted) -> Robot | None:
        """A worker is back; whose keyframe it was about, None if that does not matter any more."""
        keyframe, robot = self._extractions.done(event.keyframe), self._roster.get(event.keyframe.robot)
        if keyframe is None or robot is None:
            return None
        if event.features is None:
            robot.ledgers["keyframe"].reject((keyframe.id.boot, keyframe.id.sequence), event.code)
            robot.last_problem = event.problem
        elif keyframe.id.boot != robot.boot or _older(keyframe, self._successors[robot.id] or robot.keyframe):
            self._replace(keyframe)
        else:
            self._succeed(robot, replace(keyframe, features=event.features, thumbnail=event.thumbnail))
        return robot

    def start(self) -> list[Effect]:
        """Extractions to be done now."""
        return [ExtractFeatures(keyframe) for keyframe in self._extractions.start()]

    def due(self, now_ns: int) -> list[str]:
        """Use what has waited until the one before came to something; the robots whose it is."""
        due = self._successors.due(self._surveys.busy, now_ns)
        for keyframe in due:
            self._use(self._roster[keyframe.id.robot], keyframe)
        return [keyframe.id.robot for keyframe in due]

    def resize(self, capacity: int) -> None:
        """So many extractions may be under way at once from now on."""
        self._extractions.capacity = capacity

    def forget(self, robot: str) -> None:
        """Drop a robot's keyframes that are not in use yet."""
        self._extractions.forget(robot)
        self._successors.withdraw(robot)

    def _succeed(self, robot: Robot, keyframe: Keyframe) -> None:
        """Use a robot's new keyframe, once the one before has come to something."""
        if self._surveys.busy(robot.id):
            self._replace(self._successors.wait(keyframe))
        else:
            self._replace(self._successors.withdraw(robot.id))
            self._use(robot, keyframe)

    def _use(self, robot: Robot, keyframe: Keyframe) -> None:
        robot.ledgers["keyframe"].settle((keyframe.id.boot, keyframe.id.sequence), "used")
        self._surveys.keyframe(robot, keyframe)

    def _replace(self, keyframe: Keyframe | None) -> None:
        if keyframe is not None:
            ledger = self._roster[keyframe.id.robot].ledgers["keyframe"]
            ledger.settle((keyframe.id.boot, keyframe.id.sequence), "replaced")


def _older(keyframe: Keyframe, held: Keyframe | None) -> bool:
    """Was it sent before another of the same boot?"""
    return held is not None and held.id.boot == keyframe.id.boot and keyframe.id.sequence < held.id.sequence

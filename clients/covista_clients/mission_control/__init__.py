"""Mission control's questions to the station over HTTP."""

from covista_clients.mission_control.control import MissionControl
from covista_clients.mission_control.events import Events

__all__ = ["Events", "MissionControl"]

"""A robot's line to the station: poses and keyframes out, its group back."""

from covista_clients.rover.content import Send
from covista_clients.rover.rover import Rover

__all__ = ["Rover", "Send"]

"""Pictures: the common field of a pair drawn in a keyframe, and the swarm from above. Arrays in, PNG bytes out."""

from covista_service.drawing.overlay import CommonField, overlay
from covista_service.drawing.swarm_map import swarm_map

__all__ = ["CommonField", "overlay", "swarm_map"]

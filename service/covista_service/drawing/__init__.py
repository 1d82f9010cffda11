"""Pictures: the common field of a pair drawn in a keyframe, the swarm from above, plots. Arrays in, PNG bytes out."""

from covista_service.drawing.overlay import CommonField, Side, overlay, side_by_side, view
from covista_service.drawing.swarm_map import swarm_map

__all__ = ["CommonField", "Side", "overlay", "side_by_side", "swarm_map", "view"]

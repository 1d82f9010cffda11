"""Clients of a Covista station: a rover tells what it sees, mission control asks who sees what in common.

```python
from covista_clients import Camera, MissionControl, Pose, Rover
```
"""

from covista_schemas.messages import Camera, Distortion, FeatureKind, Features, Pose
from covista_schemas.zenoh_tls import Tls

from covista_clients.mission_control import MissionControl
from covista_clients.rover import Rover

__all__ = ["Camera", "Distortion", "FeatureKind", "Features", "MissionControl", "Pose", "Rover", "Tls"]

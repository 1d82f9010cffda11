"""The zenoh side of the station: what robots say comes in here, what the station tells goes out here."""

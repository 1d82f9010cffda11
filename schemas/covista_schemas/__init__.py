"""What crosses the air between robots, station and mission control."""

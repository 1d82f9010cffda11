"""The core of the station, without I/O or clock: events in, effects out."""

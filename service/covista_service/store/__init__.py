"""The history of groups and events in a database, off the hot path."""

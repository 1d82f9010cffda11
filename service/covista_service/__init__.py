"""The Covista station."""

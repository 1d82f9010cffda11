"""Clients of a Covista station."""

"""Recordings, methods, metrics."""

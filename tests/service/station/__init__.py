"""Tests of covista_service.station."""

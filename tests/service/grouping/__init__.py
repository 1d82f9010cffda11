"""Tests of covista_service.grouping."""

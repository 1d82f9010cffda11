"""Tests of the simulated swarm."""

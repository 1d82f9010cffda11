"""Tests of the maths of perception."""

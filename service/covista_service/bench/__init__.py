"""Benchmarks with marks to hold, beside what others offer: `covista-station bench`."""

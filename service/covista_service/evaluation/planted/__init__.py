"""Swarms whose groups are known because they were planted, and how well they are found: `covista-station planted`."""

"""Station and simulated swarm as processes of their own, watched and judged: `covista-station demo`."""

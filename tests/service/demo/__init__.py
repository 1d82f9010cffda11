"""Station and swarm as processes."""

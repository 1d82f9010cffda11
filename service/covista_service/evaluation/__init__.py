"""Methods against recordings whose overlap is known: `covista-station evaluate`."""

"""The paper's tables and figures, rebuilt and compared with what it prints: `covista-station paper`."""

"""What `covista` can be told to do, one function per command."""

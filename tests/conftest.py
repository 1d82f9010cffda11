"""What all tests share: no example of a law is late, for on a fresh machine the first one waits for a compiler."""

from hypothesis import settings

settings.register_profile("covista", deadline=None)
settings.load_profile("covista")

"""Settings of all tests."""

from hypothesis import settings

# No deadlines: benchmarks measure speed, and the time of a draw depends on the machine's load.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

"""What holds for all tests."""

from hypothesis import settings

# Speed is measured in benchmarks: how long a draw takes depends on what else runs.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

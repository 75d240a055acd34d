"""The linearly implicit scheme, which steps the simulated garment."""

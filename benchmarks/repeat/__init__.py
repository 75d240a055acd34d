"""The same seed gives the same numbers, under any load, in one process or in several."""

"""Compares the local solver with the exact optimum and the time of a cone programme."""

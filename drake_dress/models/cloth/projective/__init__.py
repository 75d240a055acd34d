"""Projective Dynamics, iterated to convergence: the reference."""

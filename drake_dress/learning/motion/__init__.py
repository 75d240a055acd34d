"""Sequences of persons in moving garments, from which motion and intent are learned."""

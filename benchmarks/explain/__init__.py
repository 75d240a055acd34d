"""Measures how often `drake-dress explain` identifies an effect hidden in data."""

"""Measures the plan delay on this machine."""

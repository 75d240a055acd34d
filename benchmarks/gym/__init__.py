"""Measures the environment's speed, and dresses persons through its actions."""

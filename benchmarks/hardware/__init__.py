"""Measures a run and its lab in two processes in their own network namespace."""

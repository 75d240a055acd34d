"""Converts the sections of a scenario to the values that diagram builders take, a module each."""

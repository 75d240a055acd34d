"""Checks that equal seeds give equal numbers, under any load, in one or several processes."""

"""Tests runs that are killed, terminated, or whose disk fills, at random times."""

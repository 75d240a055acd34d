"""Dressings in another simulator's world."""

"""Estimates from camera images."""

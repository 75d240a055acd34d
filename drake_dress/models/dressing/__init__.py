"""Dressing coordinates, sleeve states and stages."""

"""Drawn coats on drawn bodies: what becomes of those that the look calls fitting or too tight."""

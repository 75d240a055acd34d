"""Garment files of all kinds, made at run time with known openings: read right, or refused."""

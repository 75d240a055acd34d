"""Labelled garment meshes."""

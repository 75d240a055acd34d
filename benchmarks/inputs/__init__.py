"""Drawn bad inputs: what the program does with scenarios, meshes, recordings and messages."""

"""Tests the program with random bad inputs: scenarios, meshes, recordings and messages."""

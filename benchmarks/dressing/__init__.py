"""The dressing experiments: comparison of methods, persons, coats and seeds."""

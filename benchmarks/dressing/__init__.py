"""The dressing experiments: methods, persons, coats and seeds against each other."""

"""A person's skin from sex, age, height and weight, or from a scan; its pose and its measures."""

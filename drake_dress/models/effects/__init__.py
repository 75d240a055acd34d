"""Physical effects that extend the model; each is one small object, listed in `registry.py`."""

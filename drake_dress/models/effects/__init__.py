"""Physical effects that extend the model: one small object each, listed in `registry.py`."""

"""How the linear system of a step is solved: one file a scheme, one interface (interface.py)."""

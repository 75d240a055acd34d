"""How fast a dressing runs, beside an earlier version of the code."""

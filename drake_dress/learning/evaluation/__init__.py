"""How well persons are predicted: baselines, errors, coverage and intent on any motion."""

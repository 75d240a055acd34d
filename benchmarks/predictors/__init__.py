"""Dressings of active persons with each predictor of their motion."""

"""Compares measured data with simulation, names causes, extends the model and reports."""

"""Measured data against simulation: compare, name what is wrong, extend the model, report."""

"""Accuracy of the plant's garment against a finer reference, and cost of a step."""

"""The plant's garment: how far it is from a finer reference, and what a step takes."""

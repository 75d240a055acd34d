"""Planning of the grippers through the garment model."""

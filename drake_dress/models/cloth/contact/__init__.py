"""What the garment touches, and where."""

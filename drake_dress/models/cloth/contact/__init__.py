"""Contact of the garment with bodies."""

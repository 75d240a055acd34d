"""Drake systems, one per file."""

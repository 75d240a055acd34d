"""Drake systems, one a file."""

"""A run and its lab in two processes, with a network of their own."""

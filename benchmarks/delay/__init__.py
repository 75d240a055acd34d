"""How long plans take on this machine."""

"""Checks of the messages that a station receives, and reactions to faults."""

"""Learned prediction of a person's arms: intent, motion, and joints that cloth hides."""

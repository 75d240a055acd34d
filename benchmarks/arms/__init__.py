"""Runs all dressing scenarios with floating grippers and with two Panda arms."""

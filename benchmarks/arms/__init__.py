"""All dressing scenarios, with floating grippers and with two Panda arms."""

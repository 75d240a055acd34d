"""The body as capsules on articulated arms."""

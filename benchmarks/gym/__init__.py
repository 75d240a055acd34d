"""Speed of the environment, and dressings through its actions."""

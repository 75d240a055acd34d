"""How well the person is predicted."""

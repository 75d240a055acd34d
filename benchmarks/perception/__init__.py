"""How well the coat is seen with cameras."""

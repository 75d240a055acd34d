"""How often `drake-dress explain` is right: data that hide an effect, and what it says of them."""

"""A sparse LDLᵀ factor of P that can leave nodes out."""

"""The paper's scheme with bias: explicit iteration, dry friction, exact derivatives."""

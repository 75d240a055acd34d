"""Parts of the Projective Dynamics reference."""

"""The solver of the local problem against the exact optimum and the cone programme's time."""

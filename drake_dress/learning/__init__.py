"""Training data and training of the networks that the package ships."""

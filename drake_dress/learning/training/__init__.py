"""Training of the networks that predict a person: needs torch, which a run does not."""

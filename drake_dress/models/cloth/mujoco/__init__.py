"""The garment in MuJoCo: another simulator's cloth and contact behind the same interface."""

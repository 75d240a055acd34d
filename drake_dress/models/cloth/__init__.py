"""The garment as a mechanical system: forces, contact, steps and their derivatives."""

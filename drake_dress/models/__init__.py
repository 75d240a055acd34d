"""Plain numerics: arrays in, arrays out, without Drake."""

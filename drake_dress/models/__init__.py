"""Plain numerics: arrays in, arrays out, without Drake."""

from drake_dress import kernel_cache

# Before any kernel is defined.
kernel_cache.install()

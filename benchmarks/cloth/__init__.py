"""Compares the cloth schemes with each other, a fine reference and other simulators.

`python -m benchmarks.cloth --help` lists the measurements. The package itself imports nothing from
here.
"""

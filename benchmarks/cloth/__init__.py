"""The cloth schemes against each other, against a fine reference and against other simulators.

`python -m benchmarks.cloth --help` says what can be measured. Nothing here is imported by the
package itself.
"""

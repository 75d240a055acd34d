"""Other simulators behind the interface of `benchmarks.cloth.engines.Engine`."""

"""Measurements of their own, each run by a script of `benchmarks/`."""

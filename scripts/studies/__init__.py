"""Measurements of their own, each run by `python scripts/studies NAME`."""

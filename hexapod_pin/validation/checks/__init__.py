"""Comparisons that show whether independent formulations agree."""

"""Gains of foot control up to which a robot stands still: predicted, and found by simulation."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.gain_borders import gain_borders
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(gain_borders, argv)


if __name__ == "__main__":
    sys.exit(main())

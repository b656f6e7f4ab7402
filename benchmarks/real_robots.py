"""Robots from the world, by the command line, as downloaded and mended."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.real_robots import real_robots
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(real_robots, argv)


if __name__ == "__main__":
    sys.exit(main())

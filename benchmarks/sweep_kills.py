"""Sweeps and their workers killed at a hundred random moments: the dataset keeps its bits."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.sweep_kills import sweep_kills
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(sweep_kills, argv)


if __name__ == "__main__":
    sys.exit(main())

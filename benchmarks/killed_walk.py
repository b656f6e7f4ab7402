"""A long walk from checkpoint to checkpoint, its process killed at random moments."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.killed_walk import killed_walk
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(killed_walk, argv)


if __name__ == "__main__":
    sys.exit(main())

"""A batch of two thousand walks: time, memory, two threads over one."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.batch import batch
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(batch, argv)


if __name__ == "__main__":
    sys.exit(main())

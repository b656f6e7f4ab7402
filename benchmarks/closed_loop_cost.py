"""What 200 Hz control costs: one run and 64 in lock-step, with their errors."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.closed_loop_cost import closed_loop_cost
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(closed_loop_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

"""What prescribed motion costs beside servos, with errors; torques of servos that stiffen."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.prescribed_cost import prescribed_cost
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(prescribed_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

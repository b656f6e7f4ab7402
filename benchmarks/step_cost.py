"""What a step, a walk and a batch cost, beside MuJoCo and Pinocchio, and their errors."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.step_cost import step_cost
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(step_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

"""What a robust step costs, beside Pinocchio's calls and MuJoCo's step."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.robust_cost import robust_cost
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(robust_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

"""A plan sent at ticks: how it converges to the plan as the period goes to 0."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.plan_at_ticks import plan_at_ticks
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(plan_at_ticks, argv)


if __name__ == "__main__":
    sys.exit(main())

"""S1's foot control beside conventional kinematic control: all grounds, targets, noise, 10 m."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.foot_control import foot_control
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(foot_control, argv)


if __name__ == "__main__":
    sys.exit(main())

"""Motors chosen without their mass, and without their torque-speed line: what fails."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.motor_feedback import motor_feedback
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(motor_feedback, argv)


if __name__ == "__main__":
    sys.exit(main())

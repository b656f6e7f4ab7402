"""How far joints in maximal coordinates drift apart: Baumgarte's terms, the step, projection."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.constraint_drift import constraint_drift
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(constraint_drift, argv)


if __name__ == "__main__":
    sys.exit(main())

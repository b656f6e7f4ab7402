"""The accuracy asked for and the error made, over random scenes."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.tolerance_calibration import tolerance_calibration
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(tolerance_calibration, argv)


if __name__ == "__main__":
    sys.exit(main())

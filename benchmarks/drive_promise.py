"""The accuracy asked for and the error made where drives switch, over random scenes."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.drive_promise import drive_promise
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(drive_promise, argv)


if __name__ == "__main__":
    sys.exit(main())

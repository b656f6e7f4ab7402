"""One hour of walking at 1 ms: nothing but the clock may change."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.one_hour import one_hour
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(one_hour, argv)


if __name__ == "__main__":
    sys.exit(main())

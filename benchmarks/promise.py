"""Is an error stated an error kept? Over scenes drawn anew in every run."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.promise import promise
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(promise, argv)


if __name__ == "__main__":
    sys.exit(main())

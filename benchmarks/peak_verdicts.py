"""Which peak torques of walks hold when they are computed again, and what moves the others."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.peak_verdicts import peak_verdicts
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(peak_verdicts, argv)


if __name__ == "__main__":
    sys.exit(main())

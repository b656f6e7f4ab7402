"""What a million walks cost on a hundred and a thousand cores, and what saturates first."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.sweep_scale import sweep_scale
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(sweep_scale, argv)


if __name__ == "__main__":
    sys.exit(main())

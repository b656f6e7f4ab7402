"""By how much the sampling grid misses the peaks of joint torques, and summaries do not."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.peak_sampling import peak_sampling
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(peak_sampling, argv)


if __name__ == "__main__":
    sys.exit(main())

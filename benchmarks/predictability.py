"""How long is a trajectory a prediction? Growth of a small error at the start."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.predictability import predictability
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(predictability, argv)


if __name__ == "__main__":
    sys.exit(main())

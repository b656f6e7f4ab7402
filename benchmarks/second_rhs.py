"""The native core beside a second right-hand side in Python, integrated by SciPy."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.second_rhs import second_rhs
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(second_rhs, argv)


if __name__ == "__main__":
    sys.exit(main())

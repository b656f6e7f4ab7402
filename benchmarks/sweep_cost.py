"""Ten thousand walks on two cores: time, memory, size; beside MuJoCo at the same trunk error."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.sweep_cost import sweep_cost
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(sweep_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

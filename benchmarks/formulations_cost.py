"""What one evaluation and one stance cost in each formulation."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # 24 x 24: threads only wait for each other

from hexapod_pin.benchmark.studies.formulations_cost import formulations_cost  # noqa: E402
from hexapod_pin.benchmark.study import run_study  # noqa: E402


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(formulations_cost, argv)


if __name__ == "__main__":
    sys.exit(main())

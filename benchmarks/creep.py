"""How fast a standing robot creeps under a side load, ours beside MuJoCo's."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.creep import creep
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(creep, argv)


if __name__ == "__main__":
    sys.exit(main())

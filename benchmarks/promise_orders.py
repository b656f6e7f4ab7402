"""Error against accuracy where a scene switches."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.promise_orders import promise_orders
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(promise_orders, argv)


if __name__ == "__main__":
    sys.exit(main())

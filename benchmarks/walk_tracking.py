"""Speed, heading and turn rate of every gait beside its plan, at any heading and foot radius."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.walk_tracking import walk_tracking
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(walk_tracking, argv)


if __name__ == "__main__":
    sys.exit(main())

"""Commands killed or stopped at random moments: nothing is broken, nothing finished is lost."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.command_kills import command_kills
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(command_kills, argv)


if __name__ == "__main__":
    sys.exit(main())

"""The accuracy asked for and the error made over long walks of every gait."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.benchmark.studies.promise_walks import promise_walks
from hexapod_pin.benchmark.study import run_study


def main(argv: Sequence[str] | None = None) -> int:
    """Run the study, write its results; return the exit status."""
    return run_study(promise_walks, argv)


if __name__ == "__main__":
    sys.exit(main())

"""Writes validation/data/hc40_references.json: HC40's end states by SciPy over Pinocchio's ABA."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hexapod_pin.validation.cases.hc40_by_scipy import write_references


def main(argv: Sequence[str] | None = None) -> int:
    """Compute and write; takes some ten minutes. Return the exit status."""
    for line in write_references():
        print(line)
    return 0


if __name__ == "__main__":
    sys.exit(main())

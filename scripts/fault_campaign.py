"""Odd inputs through every public door: each must be used, or refused with an error of the package.

    python scripts/fault_campaign.py --inputs 100000 --processes 2 --page faults.md
    python scripts/fault_campaign.py --doors forged_trace --seed 17        # one input again, here

Seeds come from the clock. The exit status is 1 where there was a fault.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from hexapod_pin.fuzz import DOORS, Outcome, run_campaign
from hexapod_pin.validation.tables import Table


def main() -> int:
    """Run inputs, print and write what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--doors", default=",".join(DOORS))
    parser.add_argument("--seed", type=int, help="this input alone, with its traceback")
    parser.add_argument("--page", type=Path, help="Markdown file to write")
    given = parser.parse_args()
    doors = given.doors.split(",")
    if given.seed is not None:
        import random

        DOORS[doors[0]](random.Random(f"{doors[0]}/{given.seed}"))
        return 0
    first, begin = time.time_ns() // 1000, time.monotonic()
    inputs = [(doors[k % len(doors)], first + k) for k in range(given.inputs)]
    found = run_campaign(inputs, given.processes, _Teller(len(inputs)))
    spent = time.monotonic() - begin
    text = page(found, len(inputs), first, spent)
    print(text)
    if given.page:
        given.page.write_text(text, encoding="utf-8")
    return int(any(outcome.kind == "FAULT" for outcome in found))


class _Teller:
    """Shows progress on stderr."""

    def __init__(self, total: int) -> None:
        """Begin at none."""
        self.total, self.done, self.faults = total, 0, 0

    def __call__(self, outcome: Outcome) -> None:
        """Count an outcome."""
        self.done += 1
        if outcome.kind == "FAULT":
            self.faults += 1
            print(f"{outcome.door} {outcome.seed}: {outcome.told}", file=sys.stderr, flush=True)
        if self.done % 500 == 0 or self.done == self.total:
            told = f"{self.done} of {self.total} inputs, {self.faults} faults"
            print(told, file=sys.stderr, flush=True)


def page(found: list[Outcome], asked: int, first: int, spent: float) -> str:
    """Return the table of doors and the list of distinct faults."""
    rows = []
    for door in DOORS:
        own = [outcome for outcome in found if outcome.door == door]
        kinds = Counter(outcome.kind for outcome in own)
        slowest = max((outcome.seconds for outcome in own), default=0.0)
        counts = (str(kinds[kind]) for kind in ("used", "refused", "FAULT"))
        rows.append((door, str(len(own)), *counts, f"{slowest:.2f}"))
    head = ("door", "inputs", "used", "refused", "FAULT", "slowest [s]")
    faults: dict[tuple[str, str], Outcome] = {}
    for outcome in found:
        if outcome.kind == "FAULT":
            faults.setdefault((outcome.door, outcome.told), outcome)
    listed = [(one.door, str(one.seed), one.told) for one in faults.values()]
    about = (
        f"{len(found)} of {asked} inputs, seeds from {first}; {spent:.0f} s. "
        f"{sum(outcome.kind == 'FAULT' for outcome in found)} faults."
    )
    parts = [Table("Doors", head, rows), Table("Faults", ("door", "seed", "what"), listed)]
    return "\n\n".join(["# Odd inputs", about, *(part.markdown() for part in parts)]) + "\n"


if __name__ == "__main__":
    sys.exit(main())

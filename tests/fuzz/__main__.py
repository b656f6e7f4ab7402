"""Odd inputs through every public door: each must be used, or refused with an error of the package.

    python tests/fuzz --inputs 95000 --commands 5000 --processes 2 > faults.md
    python tests/fuzz --again forged_trace 17        # one input again, here

Inputs are tried in watched processes, commands as processes of their own besides; files of others
lie around all of them and are looked at. Seeds come from the clock. Ctrl-C keeps what is done. The
exit status is 1 where there was a fault.
"""

from __future__ import annotations

import argparse
import compileall
import random
import sys
import sysconfig
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # in place of this folder
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from fuzz import DOORS, SELDOM, Outcome, run_campaign
from fuzz.campaign import FAULT, REFUSED, USED
from fuzz.command_process import run_one
from fuzz.doors import WEIGHTS
from fuzz.values import FaultFound
from hexapod_pin.errors import HexapodError
from hexapod_pin.text_table import Table

ROOT = Path(__file__).resolve().parents[2]


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000, help="in watched processes")
    parser.add_argument("--commands", type=int, default=200, help="as processes of their own")
    parser.add_argument("--processes", type=int, default=2, help="at a time")
    parser.add_argument("--doors", default=",".join(DOORS), help="separated by commas")
    parser.add_argument("--seed", type=int, help="first seed; default: of the clock")
    parser.add_argument("--again", nargs=2, metavar=("DOOR", "SEED"), help="one input, here")
    given = parser.parse_args(argv)
    if given.again:
        return again(*given.again)
    first = given.seed if given.seed is not None else time.time_ns() // 1000
    begin, inputs, done = time.monotonic(), drawn(given, first), Counter[str]()

    def report(outcome: Outcome) -> None:
        done[outcome.kind] += 1
        if outcome.kind == FAULT:
            print(f"{outcome.door} {outcome.seed}: {outcome.fault}", file=sys.stderr, flush=True)
        if done.total() % 500 == 0:
            print(f"{done.total()} of {len(inputs)} inputs", file=sys.stderr, flush=True)

    if any(door in SELDOM for door, _ in inputs):
        write_byte_code(given.processes)
    found = run_campaign(inputs, given.processes, report)
    print(
        f"# Odd inputs\n\n{len(found)} of {len(inputs)} inputs, seeds from {first}; "
        f"{time.monotonic() - begin:.0f} s. {done[FAULT]} faults. Times are processor times.\n"
    )
    print(*tables(found), sep="\n\n")
    return int(done[FAULT] > 0)


def write_byte_code(processes: int) -> None:
    """Compile all modules: commands write none, and would take seconds to compile what they use.

    Some of them run with PYTHONOPTIMIZE=2, which has byte code of its own.
    """
    for folder in (ROOT / "hexapod_pin", sysconfig.get_paths()["purelib"]):
        levels: Any = [0, 2]  # the type of `optimize` is not written as what it takes
        compileall.compile_dir(folder, quiet=2, workers=processes, optimize=levels)


def drawn(given: argparse.Namespace, first: int) -> list[tuple[str, int]]:
    """Return door and seed of each input, commands spread among the others."""
    doors = given.doors.split(",")
    if not set(doors) <= set(DOORS):
        sys.exit(f"no such doors: {given.doors}; there are {', '.join(DOORS)}")
    often = [door for door in doors if door not in SELDOM for _ in range(WEIGHTS.get(door, 1))]
    seldom = [door for door in doors if door in SELDOM]
    counts = [(given.inputs if often else 0, often), (given.commands if seldom else 0, seldom)]
    found = [(own[k % len(own)], first + k) for count, own in counts for k in range(count)]
    random.Random(first).shuffle(found)
    return found


def again(door: str, seed: str) -> int:
    rng = random.Random(f"{door}/{seed}")
    try:
        if door in SELDOM:
            ran = run_one(rng, keep=True)
            print(f"{ran.given}\n{ran.ending}\nin {ran.folder}")
            if ran.error is not None:
                raise ran.error
        else:
            DOORS[door](rng)
    except FaultFound as found:
        print(f"fault: {found}")
        return 1
    except HexapodError as error:
        print(f"refused: {error}")
    return 0


def tables(found: Sequence[Outcome]) -> list[str]:
    rows, causes = [], dict[tuple[str, str], list[Outcome]]()
    for door in sorted({outcome.door for outcome in found}, key=list(DOORS).index):
        own = [outcome for outcome in found if outcome.door == door]
        kinds = Counter(outcome.kind for outcome in own)
        seconds = [outcome.seconds for outcome in own]
        counts = (str(kinds[kind]) for kind in (USED, REFUSED, FAULT))
        times = (f"{sum(seconds) / len(own):.3f}", f"{max(seconds):.2f}")
        rows.append((door, str(len(own)), *counts, *times))
        for outcome in own:
            if outcome.kind == FAULT:
                causes.setdefault((door, outcome.cause), []).append(outcome)
    head = ("door", "inputs", USED, REFUSED, FAULT, "mean [s]", "slowest [s]")
    listed = [
        (one[0].door, str(one[0].seed), str(len(one)), one[0].fault)
        for one in sorted(causes.values(), key=len, reverse=True)
    ]
    shown = [Table("Doors", head, rows)]
    shown += [Table("Faults", ("door", "seed", "times", "what"), listed)] if listed else []
    return [table.markdown() for table in shown]


if __name__ == "__main__":
    sys.exit(main())

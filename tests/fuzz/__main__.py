"""Odd inputs through every public door: each must be used, or refused with an error of the package.

    python tests/fuzz --inputs 95000 --commands 5000 --processes 2 --page faults.md
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

from fuzz import DOORS, SELDOM, WEIGHTS, Outcome, run_campaign
from fuzz.campaign import FAULT, REFUSED, USED
from fuzz.command_process import run_one
from fuzz.command_run import PATIENCE
from fuzz.shown import FaultFound
from hexapod_pin.errors import HexapodError
from hexapod_pin.text_table import Table

ROOT = Path(__file__).resolve().parents[2]


def main(argv: Sequence[str] | None = None) -> int:
    """Run inputs, print and write what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000, help="in watched processes")
    parser.add_argument("--commands", type=int, default=200, help="as processes of their own")
    parser.add_argument("--processes", type=int, default=2, help="at a time")
    parser.add_argument("--doors", default=",".join(DOORS), help="separated by commas")
    parser.add_argument("--seed", type=int, help="first seed; default: of the clock")
    parser.add_argument("--page", type=Path, help="Markdown file to write")
    parser.add_argument("--again", nargs=2, metavar=("DOOR", "SEED"), help="one input, here")
    given = parser.parse_args(argv)
    if given.again:
        return again(*given.again)
    first, begin = (
        given.seed if given.seed is not None else time.time_ns() // 1000,
        time.monotonic(),
    )
    inputs = drawn(given.doors.split(","), given.inputs, given.commands, first)
    if any(door in SELDOM for door, _ in inputs):
        write_byte_code(given.processes)
    found = run_campaign(inputs, given.processes, _Progress(len(inputs)))
    text = page(found, len(inputs), first, time.monotonic() - begin)
    print(text)
    if given.page:
        given.page.write_text(text, encoding="utf-8")
    return int(any(outcome.kind == FAULT for outcome in found))


def write_byte_code(processes: int) -> None:
    """Compile all modules: commands write none, and would take seconds to compile what they use.

    Some of them run with PYTHONOPTIMIZE=2, which has byte code of its own.
    """
    for folder in (ROOT / "hexapod_pin", sysconfig.get_paths()["purelib"]):
        levels: Any = [0, 2]  # the type of `optimize` is not written as what it takes
        compileall.compile_dir(folder, quiet=2, workers=processes, optimize=levels)


def drawn(doors: Sequence[str], inputs: int, commands: int, first: int) -> list[tuple[str, int]]:
    """Return door and seed of each input, commands spread evenly among the others."""
    unknown = sorted(set(doors) - set(DOORS))
    if unknown:
        sys.exit(f"no such doors: {', '.join(unknown)}; there are {', '.join(DOORS)}")
    found = list[tuple[float, str, int]]()
    for count, own in (
        (inputs, [one for one in doors if one not in SELDOM for _ in range(WEIGHTS.get(one, 1))]),
        (commands, [door for door in doors if door in SELDOM]),
    ):
        for k in range(count if own else 0):
            found.append(((k + 0.5) / count, own[k % len(own)], first + k))
    return [(door, seed) for _, door, seed in sorted(found)]


def again(door: str, seed: str) -> int:
    """Try one input here; show the exception, or all that a command did."""
    rng = random.Random(f"{door}/{seed}")
    try:
        if door in SELDOM:
            ran = run_one(rng, keep=True)
            print(f"{ran.given.as_shell()}\n{ran.ending}\nin {ran.folder}")
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


class _Progress:
    """Shows progress on stderr."""

    def __init__(self, total: int) -> None:
        """Begin at none."""
        self.total, self.done, self.faults = total, 0, 0
        self.known = set[tuple[str, str]]()

    def __call__(self, outcome: Outcome) -> None:
        """Count an outcome; show the first of each cause."""
        self.done += 1
        if outcome.kind == FAULT:
            self.faults += 1
            if (outcome.door, outcome.cause) not in self.known:
                self.known.add((outcome.door, outcome.cause))
                text = f"{outcome.door} {outcome.seed}: {outcome.fault} {outcome.repeat}"
                print(text, file=sys.stderr, flush=True)
        if self.done % 500 == 0 or self.done == self.total:
            text = f"{self.done} of {self.total} inputs, {self.faults} faults"
            print(text, file=sys.stderr, flush=True)


def page(found: list[Outcome], requested: int, first: int, spent: float) -> str:
    """Return the table of doors and the list of distinct faults."""
    rows = []
    for door in DOORS:
        own = [outcome for outcome in found if outcome.door == door]
        if not own:
            continue
        kinds = Counter(outcome.kind for outcome in own)
        seconds = [outcome.seconds for outcome in own]
        counts = (str(kinds[kind]) for kind in (USED, REFUSED, FAULT))
        times = (f"{sum(seconds) / len(own):.3f}", f"{max(seconds):.2f}")
        files = (str(sum(one.watched for one in own)), str(sum(one.changed for one in own)))
        rows.append((door, str(len(own)), *counts, *times, *files))
    head = ("door", "inputs", USED, REFUSED, FAULT, "mean [s]", "slowest [s]", "looks", "changed")
    causes: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in found:
        if outcome.kind == FAULT:
            causes.setdefault((outcome.door, outcome.cause), []).append(outcome)
    listed = [
        (one[0].door, str(one[0].seed), str(len(one)), one[0].fault, one[0].repeat)
        for one in sorted(causes.values(), key=len, reverse=True)
    ]
    long = sum(one.seconds > PATIENCE and one.kind != FAULT for one in found)
    about = (
        f"{len(found)} of {requested} inputs, seeds from {first}; {spent:.0f} s. "
        f"{sum(outcome.kind == FAULT for outcome in found)} faults. Times are processor times; "
        f"looks are at files of others, after each input. {long} commands took more than "
        f"{PATIENCE:g} s and are no faults: in several processes, or as long as the sound command."
    )
    faults = Table("Faults", ("door", "seed", "times", "what", "by hand"), listed)
    parts = [Table("Doors", head, rows), *([faults] if listed else [])]
    return "\n\n".join(["# Odd inputs", about, *(part.markdown() for part in parts)]) + "\n"


if __name__ == "__main__":
    sys.exit(main())

"""Walk the built-in robots rewritten in random conventions, and compare their torques.

    python scripts/studies rewritten_robots [--count 200] [--seed BASE] [--repair] [--out FILE]

Without a base seed one is drawn and printed. Every failure is a line with FAIL and its seed.
"""

from __future__ import annotations

import argparse
import secrets
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rewriting.comparison import (
    CYCLES,
    FOOT_TOLERANCE,
    METHOD,
    ROBOTS,
    STEP,
    TORQUE_TOLERANCE,
    Difference,
    difference,
    reference_walk,
)

from hexapod_pin.atomic_file import write_atomically
from studies.study import RESULTS

OUT = RESULTS / "rewritten_robots.md"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; 1 where a robot does not walk like its original."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--repair", action="store_true")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    base = secrets.randbits(32) if options.seed is None else options.seed
    print(f"base seed {base}")
    walks = {robot: reference_walk(robot, options.repair) for robot in ROBOTS}
    rows = []
    for k in range(options.count):
        robot = ROBOTS[k % len(ROBOTS)]
        row = difference(robot, base + k, walks[robot], repair=options.repair)
        rows.append(row)
        if not row.passed:
            print(f"\nFAIL seed {row.seed} {robot}: {reason(row)} [{row.conventions.text}]")
        failed = sum(not row.passed for row in rows)
        print(f"\r{k + 1} of {options.count}, {failed} failed", end="", flush=True, file=sys.stderr)
    print(file=sys.stderr)
    write_atomically(options.out, report(rows, base, options.repair))
    print(f"{sum(row.passed for row in rows)} of {len(rows)} walk like the original; {options.out}")
    return 0 if all(row.passed for row in rows) else 1


def reason(row: Difference) -> str:
    """Return why a row failed."""
    return row.failure or f"torque differs by {row.torque:.2e}, feet by {1e3 * row.foot:.3g} mm"


def report(rows: Sequence[Difference], base: int, repair: bool) -> str:
    """Return the results as a page of Markdown."""
    lines = [
        "# Robots rewritten in other conventions",
        "",
        "`python scripts/studies rewritten_robots`",
        "",
        f"{len(rows)} random combinations, base seed {base}{', repaired' if repair else ''}: "
        "root frame, names, axis signs, zero postures, link frames, fixed joints, foot frames, "
        "meshes, order. "
        f"Reference: the same robot without its `<hexapod_pin>` element. {CYCLES} cycles of the "
        f"default tripod, {METHOD}, step {STEP:g} s.",
        "",
        f"Torque: largest difference of a joint's torque over the walk, relative to the walk's "
        f"largest torque (allowed {TORQUE_TOLERANCE:g}). Foot: largest distance between foot "
        f"centres where the robots stand (allowed {1e3 * FOOT_TOLERANCE:g} mm).",
        "",
        "| robot | files | walk like the original | largest torque difference | largest foot "
        "distance [mm] |",
        "|---|---|---|---|---|",
    ]
    for robot in ROBOTS:
        mine = [row for row in rows if row.robot == robot]
        walked = [row for row in mine if not row.failure]
        torque = max((row.torque for row in walked), default=np.nan)
        foot = 1e3 * max((row.foot for row in walked), default=np.nan)
        passed = sum(row.passed for row in mine)
        lines.append(f"| {robot} | {len(mine)} | {passed} | {torque:.1e} | {foot:.1e} |")
    failed = [row for row in rows if not row.passed]
    if failed:
        lines += ["", "| seed | robot | conventions | failure |", "|---|---|---|---|"]
        lines += [
            f"| {row.seed} | {row.robot} | {row.conventions.text} | {reason(row)} |".replace(
                "\n", " "
            )
            for row in failed
        ]
    return "\n".join(lines) + "\n"

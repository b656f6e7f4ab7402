"""The accuracy asked for and the error made, over 36 random scenes. Writes honesty.md."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hexapod_pin.benchmark.machine import Machine
from hexapod_pin.benchmark.tolerance_calibration import (
    SEED,
    dearer,
    honesty_table,
    random_tasks,
    study,
)

RESULTS = Path(__file__).resolve().parent / "results"
METHODS = {"extrapolated-euler": (1e-3, 1e-4, 1e-5, 1e-6), "ndf": (1e-5, 1e-6, 1e-7)}


def main(argv: Sequence[str] | None = None) -> int:
    """Print the tables and write them to --out. Return 1 where a promise was not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of honesty.md")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--methods", default=",".join(METHODS))
    options = parser.parse_args(argv)
    text = f"# Accuracy asked for, error made\n\n{Machine.here()}\n\nSeed {options.seed}.\n"
    broken = 0
    for method in options.methods.split(","):
        rows = study(random_tasks(options.seed), method=method, accuracies=METHODS[method])
        bad = [row for row in rows if not row.kept]
        broken += len(bad)
        table = honesty_table(rows)
        lines = [table.head, ["---"] * len(table.head), *table.rows]
        text += f"\n## {method}\n\n"
        text += "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
        text += f"\nA looser run costs at most {dearer(rows):.2f} times a tighter one.\n"
        text += f"Beyond the promise: {len(bad)} of {len(rows)}.\n"
        text += "".join(
            f"- {row.scene} at {row.accuracy:.0e}: {row.factor:.2f} times\n" for row in bad
        )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "honesty.md").write_text(text, encoding="utf-8")
    print(text)
    return 0 if broken == 0 else 1


if __name__ == "__main__":
    sys.exit(main())

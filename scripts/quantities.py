#!/usr/bin/env python3
"""Write docs/results/quantities.md, all numbers of results, from the classes that declare them.

With `--check`, fail where the page differs from the classes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.results.schema import Record, schema
from hexapod_pin.study.runs.outcome import CaseNumbers

PAGE = Path(__file__).parents[1] / "docs" / "results" / "quantities.md"

RECORDS: tuple[type[Record], ...] = (
    hp.Trace,
    hp.Summary,
    hp.study.WalkMetrics,
    hp.study.TorqueMap,
    hp.study.GaitEnergy,
    hp.sizing.JointDemand,
    CaseNumbers,
)

HEAD = """# Numbers of results

Every number that a result holds, with its axes, its unit and its meaning: names of attributes, of
variables in netCDF files and of keys in JSON. `python scripts/quantities.py` writes this page from
the classes."""


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for record in RECORDS:
        parts.append(f"\n## {record.__name__}\n")
        parts.append("| name | axes | unit | meaning |\n| --- | --- | --- | --- |")
        for name, one in schema(record).items():
            meaning = one.meaning.replace("|", "\\|")
            parts.append(f"| `{name}` | {', '.join(one.axes)} | {one.unit} | {meaning} |")
    return "\n".join(parts) + "\n"


def main() -> None:
    """Write or check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare with the page")
    if not parser.parse_args().check:
        write_atomically(PAGE, page().encode())
    elif PAGE.read_text(encoding="utf-8") != page():
        sys.exit(f"{PAGE.name} differs from the classes: run scripts/quantities.py")


if __name__ == "__main__":
    main()

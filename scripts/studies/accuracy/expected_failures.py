"""Run every hard case and bring the registry of expected failures up to date.

Errors that have changed are written anew, entries that pass or have no row are taken out. A miss
without an entry is printed and stays a FAIL: it gets one by hand, with its reason, or is repaired.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.validation.case_result import REGISTRY, CaseResult, registry_data
from hexapod_pin.validation.cases.registry import run_hard_cases


def main(argv: Sequence[str] | None = None) -> int:
    """Run, print what has changed, write the registry; return 1 where a miss has no entry."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    results = run_hard_cases(progress=lambda done: print(f"\r{done:.0%}", end="", file=sys.stderr))
    for one in results:
        if one.kind != "pass" and one.computed:
            print(f"{one.case}, {one.what}, {one.method}: {one.error:.1e}, {one.verdict}")
    write_atomically(REGISTRY, json.dumps(updated(results), indent=1) + "\n")
    return int(any(one.failed and one.expected is None for one in results))


def updated(results: Sequence[CaseResult]) -> dict[str, dict[str, list[dict[str, object]]]]:
    """Return the registry with the errors of these results, without what they do not miss."""
    errors = {
        (one.case, one.what, one.method): one.error
        for one in results
        if one.computed and not one.passed and math.isfinite(one.error)
    }
    found: dict[str, dict[str, list[dict[str, object]]]] = {}
    for case, reasons in registry_data().items():
        for reason, rows in reasons.items():
            for row in rows:
                error = errors.get((case, row["what"], row["method"]))
                if error is not None:
                    kept = {**row, "reached": float(f"{error:.1e}")}
                    found.setdefault(case, {}).setdefault(reason, []).append(kept)
    return found

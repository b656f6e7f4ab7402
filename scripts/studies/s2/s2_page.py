"""The page docs/results/s2_study.md, from the file of S2's study; computes its peaks again."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import hexapod_pin as hp
from studies.s2.page import WALKS, write_page
from studies.s2.runs import load_part


def main(argv: Sequence[str] | None = None) -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="file of s2_study")
    parser.add_argument("out", type=Path, help="folder of the page")
    options = parser.parse_args(argv)
    study = hp.study.load_study(options.study)
    verdicts = {
        name: hp.study.judge_peaks(load_part(options.study, name, hp.Trace), threads=2)
        for name in WALKS
    }
    print(write_page(options.out, study, verdicts))
    return 0

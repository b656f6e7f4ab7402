"""S2's figure 5 from a study file: the way of the centre of mass, and the margins of stability."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.view import write_mass_center_figure
from studies.s2.runs import load_part


def main(argv: Sequence[str] | None = None) -> int:
    """Draw a walk, and print its margins and excursions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="netCDF file of the study")
    parser.add_argument("out", type=Path, help="folder of the figure")
    parser.add_argument("--group", default="paper", help="which walk")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    name = "" if options.group == "paper" else f"_{options.group}"
    trace = load_part(options.study, options.group, hp.Trace)
    print(hp.stability(trace).table())
    print(write_mass_center_figure(trace, options.out / f"s2_mass_center{name}.png"))
    return 0

"""The figure of a study's gait energy: costs against speed, and which gait is cheapest where."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.view import write_gait_energy_figure
from studies.s2.runs import load_part


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the costs, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="netCDF file of the study")
    parser.add_argument("out", type=Path, help="folder of the figure")
    parser.add_argument("--group", default="gait_energy", help="which study of energy")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    energy = load_part(options.study, options.group, hp.study.GaitEnergy)
    report(energy)
    print(write_gait_energy_figure(energy, options.out / "s2_energy.png"))
    return 0


def report(energy: hp.study.GaitEnergy) -> None:
    """Print the costs, and whether low duty is cheaper at the highest common speed."""
    for scene in energy.scenes:
        for cost in COSTS:
            print(energy.table(cost, scene))
            found = energy.duty_test(cost, scene)
            if found is not None:
                word = "cheaper" if found.low_is_cheaper else "not cheaper"
                print(f"at {found.speed:.3g} m/s low duty is {word}\n")
        speed = energy.of("measured_speed", scene) / energy.speed - 1.0
        print(f"{scene}: measured speed within {np.nanmax(np.abs(speed)):.2%} of the commanded one")

"""Figures of a study's torque map: torque against stroke and cycle time."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.view import write_torque_curves, write_torque_heat_map
from studies.s2.runs import load_part

CYCLE_TIMES = (0.71, 1.2, 2.4, 4.8)
"""Of the curves against stroke [s]."""


def main(argv: Sequence[str] | None = None) -> int:
    """Draw peak and RMS torque as curves, and the peak over both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="netCDF file of the study")
    parser.add_argument("out", type=Path, help="folder of the figures")
    parser.add_argument("--group", default="torque_map", help="which map")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    torques = load_part(options.study, options.group, hp.study.TorqueMap)
    for name in ("peak", "rms"):
        path = options.out / f"s2_torque_{name}.png"
        print(write_torque_curves(
            torques, path, quantity=f"phase_torque_{name}", cycle_times=CYCLE_TIMES
        ))  # fmt: skip
    print(write_torque_heat_map(torques, options.out / "s2_torque_map.png"))
    return 0

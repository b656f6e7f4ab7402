"""S2's figure 6 from a study file: joint torques; and what speed adds to those of a slow walk."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.view import write_joint_torque_figure, write_quasi_static_figure
from studies.s2.runs import load_part

SAMPLING = 10.0 / 600
"""Of S2: 600 samples in 10 s [s]."""


def main(argv: Sequence[str] | None = None) -> int:
    """Draw both figures, and print the largest torques of each walk by kind of joint."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path, help="netCDF file of the study")
    parser.add_argument("out", type=Path, help="folder of the figures")
    parser.add_argument("--group", default="paper", help="walk of figure 6")
    parser.add_argument("--dynamic", default="constant", help="walk of the other figure")
    parser.add_argument("--slow", default="slow_tetrapod", help="the same motion, ten times slower")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    names = dict.fromkeys((options.group, options.dynamic, options.slow))
    study = {name: load_part(options.study, name, hp.Trace) for name in names}
    for name in names:
        report(name, study[name])
    path = options.out / "s2_torques.png"
    print(write_joint_torque_figure(study[options.group], path, cycles=1, points=SAMPLING))
    path = options.out / "s2_quasi_static.png"
    print(write_quasi_static_figure(study[options.dynamic], study[options.slow], path))
    return 0


def report(name: str, trace: hp.Trace) -> None:
    """Print the largest torque about an axis and the largest total moment of each kind of joint."""
    moments = hp.results.joint_moments(trace)
    kinds = np.array(joint_kinds(trace.joint_names, len(trace.foot_names)))
    for kind in dict.fromkeys(kinds.tolist()):
        axis = np.abs(moments.axis_torque[:, kinds == kind])
        total = moments.moment[:, kinds == kind]
        print(f"{name}, {kind}: axis {axis.max():.3f} (99 %: {np.percentile(axis, 99.0):.3f}), "
              f"total {total.max():.3f} (99 %: {np.percentile(total, 99.0):.3f}) N m")  # fmt: skip

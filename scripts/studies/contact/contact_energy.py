"""The energy residual of a walk, for every pair of contact laws, against the step.

stored energy - servo work + losses should stay put; what moves is the method's error (HC31). The
implicit step is of order 1: a quarter of the step should leave about a quarter of the residual.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence

import numpy as np

import hexapod_pin as hp
from studies.contact.contact_matrix import FRICTION, NORMAL

COARSE, FINE = 1e-3, 2.5e-4
MOST_LEFT = 0.5  # of the coarse residual, at a quarter of its step


def main(argv: Sequence[str] | None = None) -> int:
    """Print one row per pair. Return 1 if a residual does not fall."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=10.0, help="of each walk [s]")
    parser.add_argument("--every", type=int, default=1, help="run only every N-th pair")
    parser.add_argument("--rk4", type=float, help="also the explicit method at this step [s]")
    options = parser.parse_args(argv)
    pairs = list(itertools.product(NORMAL, FRICTION))[:: options.every]
    print(f"{len(pairs)} pairs, {options.duration:g} s of tetrapod; residual over throughput")
    bad = 0
    for normal, friction in pairs:
        found = [relative_residual(normal, friction, options.duration, h) for h in (COARSE, FINE)]
        row = f"{normal:32s} {friction:14s} 1 ms {found[0]:.1e}   0.25 ms {found[1]:.1e}"
        if options.rk4:
            fine = relative_residual(normal, friction, options.duration, options.rk4, "rk4")
            row += f"   rk4 at {options.rk4:g} s {fine:.1e}"
        bad += found[1] > MOST_LEFT * found[0]
        print(row, "" if found[1] <= MOST_LEFT * found[0] else "  does not fall", flush=True)
    print(f"{bad} of {len(pairs)} do not fall")
    return 1 if bad else 0


def relative_residual(
    normal: str, friction: str, duration: float, step: float, method: str = "implicit-euler"
) -> float:
    """Return the largest residual over the work that passes through joints and contacts [-]."""
    contact = hp.Contact(normal=NORMAL[normal], friction=FRICTION[friction])
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact)
    control = hp.KinematicControl(hp.Gait.tetrapod())
    trace = hp.simulate(scene, control, duration=duration, method=method, step=step, sample=0.01)
    through = np.trapezoid(np.abs(trace.torque * trace.v[:, 6:]).sum(axis=1), trace.time)
    return float(np.abs(trace.energy_residual).max() / through)

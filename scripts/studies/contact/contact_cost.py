"""What the choice of contact laws costs: microseconds a step for every pair, beside its error."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.text_table import Table
from studies.cost.native_motion import NativeMotion
from studies.cost.step_entries import STEP
from studies.cost.timing import interleaved
from studies.study import StudyReport, verdict

FINE_STEP = 2e-5
"""Of the runs that errors are against [s]."""

MAX_COST_RATIO = 1.3
"""Target: the dearest pair over the cheapest."""

NORMAL: dict[str, Any] = {
    "Hunt-Crossley": hp.Contact.s1().normal,
    "Kelvin-Voigt": hp.contact.KelvinVoigt(stiffness=4e4, damping=60.0),
    "restitution (exact)": hp.Contact.accurate().normal,
    "ADAMS IMPACT": hp.Contact.s2().normal,
}
FRICTION: dict[str, Any] = {
    "stick-slip": hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
    "tanh": hp.contact.TanhCoulomb(mu=0.7, slope=1e3),
    "ADAMS": hp.Contact.s2().friction,
    "smooth step": hp.contact.SmoothStep(mu_static=0.7, mu_dynamic=0.6, speed=5e-3),
    "Brown-McPhee": hp.contact.BrownMcPhee(mu_static=0.7, mu_dynamic=0.6, speed=5e-3),
}


def contact_cost(*, rounds: int = 15, duration: float = 2.4) -> StudyReport:
    """Cost of every pair of contact laws; duration: of the walk [s]."""
    walks, steps = pair_motions(duration), round(duration / STEP)
    runs = {name: walk.timed_run(STEP, steps) for name, walk in walks.items()}
    found = interleaved(runs, rounds)
    times = np.array(list(found.values())).T / steps * 1e6
    ratio = np.median(times / times.min(axis=1, keepdims=True), axis=0)
    rows = [
        (name, f"{np.median(times[:, k]):.2f}", f"{ratio[k]:.2f}", f"{_error(walk, duration):.1e}")
        for k, (name, walk) in enumerate(walks.items())
    ]
    return StudyReport(
        "Cost of the contact laws",
        [
            f"kharagpur, tetrapod, {duration:g} s at {STEP * 1e3:g} ms, {rounds} interleaved "
            "rounds; ratio to the cheapest pair of the same round; error: largest distance of the "
            f"trunk from the same method at {FINE_STEP * 1e3:g} ms, on a 10 ms grid.",
            Table("", ("pair", "us per step", "ratio", "error [m]"), rows),
            f"Dearest over cheapest: {ratio.max():.2f} (target: at most {MAX_COST_RATIO:g}): "
            f"{verdict(bool(ratio.max() <= MAX_COST_RATIO))}.",
        ],
        met=bool(ratio.max() <= MAX_COST_RATIO),
    )


def pair_motions(duration: float) -> dict[str, NativeMotion]:
    """Return one walk per pair of laws."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod())
    pairs = itertools.product(NORMAL.items(), FRICTION.items())
    return {
        f"{n} + {f}": NativeMotion.of(
            hp.Scene(robot, contact=hp.Contact(normal=normal, friction=friction)), control, duration
        )
        for (n, normal), (f, friction) in pairs
    }


def _error(walk: NativeMotion, duration: float) -> float:
    coarse, fine = (walk.path(step, duration).positions for step in (STEP, FINE_STEP))
    return float(np.linalg.norm(coarse - fine, axis=1).max())

"""What the choice of contact laws costs: microseconds a step for every pair, beside its error.

kharagpur walks the tetrapod at 1 ms; rounds are interleaved, ratios are taken inside a round
against the cheapest pair. Writes contact_cost.md.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import machine
import numpy as np
from motions import Motion

import hexapod_pin as hp

RESULTS = Path(__file__).resolve().parent / "results"
STEP = 1e-3
MOST = 1.3
"""Target: the dearest pair over the cheapest."""

NORMAL: dict[str, Any] = {
    "Hunt-Crossley": hp.Contact.s1().normal,
    "Kelvin-Voigt": hp.KelvinVoigt(stiffness=4e4, damping=60.0),
    "restitution (exact)": hp.Contact.accurate().normal,
    "ADAMS IMPACT": hp.Contact.s2().normal,
}
FRICTION: dict[str, Any] = {
    "stick-slip": hp.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
    "tanh": hp.TanhCoulomb(mu=0.7, slope=1e3),
    "ADAMS": hp.Contact.s2().friction,
    "smooth step": hp.SmoothStep(mu_static=0.7, mu_dynamic=0.6, speed=5e-3),
    "Brown-McPhee": hp.BrownMcPhee(mu_static=0.7, mu_dynamic=0.6, speed=5e-3),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table and write it to --out. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of contact_cost.md")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--duration", type=float, default=2.4, help="of the walk [s]")
    options = parser.parse_args(argv)
    text = report(options.rounds, options.duration)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "contact_cost.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


def motions(duration: float) -> dict[str, Motion]:
    """One walk per pair of laws."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod())
    return {
        f"{n} + {f}": Motion.of(
            hp.Scene(robot, contact=hp.Contact(normal=normal, friction=friction)), control, duration
        )
        for (n, normal), (f, friction) in itertools.product(NORMAL.items(), FRICTION.items())
    }


def report(rounds: int, duration: float) -> str:
    """Measure and return the table as Markdown."""
    before = machine.describe()
    walks = motions(duration)
    steps = round(duration / STEP)
    runs = {name: walk.timed_run(STEP, steps) for name, walk in walks.items()}
    times = np.array([[run() for run in runs.values()] for _ in range(rounds)]) / steps * 1e6
    ratio = np.median(times / times.min(axis=1, keepdims=True), axis=0)
    rows = []
    for k, (name, walk) in enumerate(walks.items()):
        error = _error(walk, duration)
        rows.append(f"| {name} | {np.median(times[:, k]):.2f} | {ratio[k]:.2f} | {error:.1e} |")
    return "\n".join(
        [
            "# Cost of the contact laws",
            "",
            machine.as_text(before, machine.load()),
            "",
            f"kharagpur, tetrapod, {duration:g} s at {STEP * 1e3:g} ms, {rounds} rounds; "
            "ratio to the cheapest pair of the same round; error: largest distance of the trunk "
            "from the same method at 0.02 ms, on a 10 ms grid.",
            "",
            "| pair | us per step | ratio | error [m] |",
            "| --- | --- | --- | --- |",
            *rows,
            "",
            f"Dearest over cheapest: {ratio.max():.2f} (target: at most {MOST:g}).",
            "",
        ]
    )


def _error(walk: Motion, duration: float) -> float:
    coarse, fine = (walk.positions(step, duration)[0] for step in (STEP, 2e-5))
    return float(np.linalg.norm(coarse - fine, axis=1).max())


if __name__ == "__main__":
    sys.exit(main())

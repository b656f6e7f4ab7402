"""Walk every normal law with every friction law on four grounds, and list what needs a small step.

A run passes when it stays finite and gains no energy: what is stored never exceeds what the servos
put in by more than 1 % of the work that passes through the joints. Steps are tried from 1 ms down.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO
from studies.contact import contact_cost

STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5)
STROKE = {"kharagpur": 0.14, "athena": 0.10}
RUBBER = hp.Contact.s1().normal.stiffness
ALLOWED_GAIN = 0.01

NORMAL: dict[str, Any] = {
    "hunt-crossley": hp.Contact.s1().normal,
    "kelvin-voigt": hp.contact.KelvinVoigt(stiffness=4e4, damping=60.0),
    "adams-impact": hp.Contact.s2().normal,
    **{
        f"restitution {model}": hp.contact.Restitution(
            stiffness=RUBBER, restitution=0.3, model=model
        )
        for model in DAMPING_RATIO
    },
}
FRICTION: dict[str, Any] = {
    name.lower().replace(" ", "-"): law for name, law in contact_cost.FRICTION.items()
}
GROUND: dict[str, Any] = {
    "flat": hp.Flat(),
    "slope 10 deg": hp.Slope(angle=np.radians(10.0)),
    "stairs": hp.Stairs(rise=0.01, run=0.2, count=5, start=0.35),
    "hills": hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the matrix and print what failed at 1 ms. Return 1 if something failed at every step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=5.0, help="of each walk [s]")
    parser.add_argument("--every", type=int, default=1, help="run only every N-th case")
    options = parser.parse_args(argv)
    tried, smaller, lost = 0, [], []
    for name, scene, control in itertools.islice(cases(), 0, None, options.every):
        step = largest_step(scene, control, options.duration)
        tried += 1
        if step is None:
            lost.append(name)
        elif step < STEPS[0]:
            smaller.append(f"{name}: {step:g} s")
    print(f"{tried} walks of {options.duration:g} s; {tried - len(smaller) - len(lost)} at 1 ms")
    print("\n".join(["at a smaller step:", *smaller, "at none:", *lost]))
    return 1 if lost else 0


def cases() -> Iterator[tuple[str, hp.Scene, hp.KinematicControl]]:
    """Every normal law x friction law x ground x robot."""
    robots = {name: hp.load_robot(name) for name in STROKE}
    for (n, normal), (f, friction), (g, ground), (r, robot) in itertools.product(
        NORMAL.items(), FRICTION.items(), GROUND.items(), robots.items()
    ):
        contact = hp.Contact(normal=normal, friction=friction)
        scene = hp.Scene(robot, terrain=ground, contact=contact)
        control = hp.KinematicControl(hp.Gait.tetrapod(stroke=STROKE[r]))
        yield f"{r}, {g}, {n}, {f}", scene, control


def largest_step(scene: hp.Scene, control: hp.KinematicControl, duration: float) -> float | None:
    """Return the first of STEPS that passes [s], or None."""
    return next((step for step in STEPS if passes(scene, control, duration, step)), None)


def passes(scene: hp.Scene, control: hp.KinematicControl, duration: float, step: float) -> bool:
    """Tell whether a walk stays finite and gains no energy."""
    try:
        trace = hp.simulate(scene, control, duration=duration, step=step, sample=0.01)
    except DivergenceError:
        return False
    stored = np.sum([trace.energy[name] for name in ("kinetic", "potential", "elastic")], axis=0)
    gained = stored - stored[0] - trace.energy["servo_work"]
    passed_on = np.abs(trace.torque * trace.v[:, 6:]).sum(axis=1)
    return bool(gained.max() < ALLOWED_GAIN * np.trapezoid(passed_on, trace.time))

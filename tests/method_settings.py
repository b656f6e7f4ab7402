"""Settings for quick short runs of each method, and the hard cases' drop."""

from __future__ import annotations

from functools import cache
from typing import Any

import vehicles

import hexapod_pin as hp

METHODS: dict[str, dict[str, float]] = {
    "extrapolated-euler": {"accuracy": 1e-5},
    "ndf": {"accuracy": 1e-6},
    "dop853": {"accuracy": 1e-6},
    "robust": {"step": 1e-3},
    "implicit-euler": {"step": 1e-3},
    "rk4": {"step": 2e-5},
}
GROUNDS = {"soft": (1e5, 1e2), "mid": (1e6, 1e3), "stiff": (1e8, 1e4)}
"""Stiffness of the contact [N/m^1.5] and slope of the friction [s/m] of HC40's variants."""


@cache
def hc40(kind: str, *, sample: float = 0.25, **settings: Any) -> hp.Trace:
    """Return HC40, 0.25 s: the reference hexapod dropped askew on one of `GROUNDS`; run once."""
    scene, start, posture = vehicles.drop(vehicles.hexa_ref())
    stiffness, slope = GROUNDS[kind]
    contact = hp.Contact(
        normal=scene.contact.normal.model_copy(update={"stiffness": stiffness}),
        friction=scene.contact.friction.model_copy(update={"slope": slope}),
    )
    scene = hp.Scene(scene.robot, contact=contact, servo=scene.servo, stops=vehicles.FREE)
    return hp.simulate(
        scene, hp.HoldPosture(posture), duration=0.25, sample=sample, initial=start, **settings
    )

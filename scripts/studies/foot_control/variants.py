"""Controllers of S1's comparison: each part of foot control alone, and parts together.

A variant whose part this version of the package does not have is left out of the comparison.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import hexapod_pin as hp

NO_PARTS = "no parts"
ANTICIPATION = "anticipation"
PID = "S1's PID"
ANTICIPATING_PID = "PID and anticipation"
SUSPENSION = "S1's suspension"
S1 = "S1's PID and suspension"
TARGETS = "force targets"
TARGETS_SUSPENSION = "force targets and suspension"
SOLE_UNKNOWN = "force targets, sole unknown"
BOTH_WAYS = "force targets, deviation from the target itself"

SINGLE_PARTS = (ANTICIPATION, PID, SUSPENSION, TARGETS)
"""Variants that have one part."""


def parts() -> dict[str, dict[str, Any]]:
    """Return the parts of each variant by the arguments of `FootControl`."""
    room = hp.foot_control
    pid = room.SlipPid(anticipates=False)
    still = room.SlipPid(kp=0.0, ki=0.0, kd=0.0)
    found: dict[str, dict[str, Any]] = {
        NO_PARTS: {},
        ANTICIPATION: {"slip": still},
        PID: {"slip": pid},
        ANTICIPATING_PID: {"slip": room.SlipPid()},
        SUSPENSION: {"suspension": leg_by_leg()},
        S1: {"slip": pid, "suspension": leg_by_leg()},
    }
    targets = getattr(room, "ForceTargets", None)
    if targets is not None:
        aimed = {"slip": room.SlipPid(), "force_targets": targets(sole="contact")}
        found[TARGETS] = aimed
        found[TARGETS_SUSPENSION] = {**aimed, "suspension": room.VirtualSuspension()}
        found[SOLE_UNKNOWN] = {**aimed, "force_targets": targets()}
        found[BOTH_WAYS] = {**aimed, "force_targets": targets(sole="contact", deviation="target")}
    return found


def leg_by_leg() -> Any:
    """Return the suspension of S1: each leg yields to its own load, in all modes."""
    kind = hp.foot_control.VirtualSuspension
    modes: dict[str, Any] = {
        name: 1.0 for name in ("heave", "tilt", "warp") if name in kind.model_fields
    }
    return kind(**modes)


def named(variant: str, tick: float) -> str:
    """Return the name of a variant at a tick [s]."""
    return f"{variant}, {1e3 * tick:g} ms"


def controls(gait: hp.Gait, ticks: tuple[float, ...]) -> dict[str, hp.FootControl]:
    """Return all variants at all ticks [s] by `named`."""
    return {
        named(variant, tick): hp.FootControl(gait, period=tick, **given)
        for tick in ticks
        for variant, given in parts().items()
    }


def variants() -> Iterator[str]:
    """Yield the names of the variants that this version of the package has."""
    yield from parts()

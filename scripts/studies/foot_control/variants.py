"""Controllers of S1's comparison: each part of foot control alone, and parts together.

The last ones are disturbed: what the controller knows of the robot is wrong or measured.
"""

from __future__ import annotations

from collections.abc import Iterable
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

KP_LOW, KP_HIGH = "force targets, kp 30 % too low", "force targets, kp 30 % too high"
TORQUES = "force targets and suspension, forces from torques"
CURRENTS = "force targets and suspension, forces from currents, noise, delay"

DISTURBED = (KP_LOW, KP_HIGH, TORQUES, CURRENTS)
"""Variants whose controller counts on other servos, or has no sensors in the feet."""

WRONG = {KP_LOW: 0.7, KP_HIGH: 1.3}
"""The gains that a controller counts on over those of the servos [-]."""

NOISE = {"torque": 0.02, "q": 1e-4}
"""Standard deviations of readings of torque [N m] and angle [rad] of CURRENTS (*assumed*)."""

CUTOFF, LATE = 40.0, 0.002
"""Of the filter of estimated forces [Hz]; delay of the sensors, and of commands, of CURRENTS [s]
(*assumed*)."""

SINGLE_PARTS = (ANTICIPATION, PID, SUSPENSION, TARGETS)
"""Variants that have one part."""


def parts(servo: hp.Servo | None = None) -> dict[str, dict[str, Any]]:
    """Return the parts of each variant by the arguments of `FootControl`.

    Args:
        servo: of the robot; None: variants that count on other servos are left out.
    """
    room = hp.foot_control
    pid = room.SlipPid(anticipates=False)
    still = room.SlipPid(kp=0.0, ki=0.0, kd=0.0)
    aimed = {"slip": room.SlipPid(), "force_targets": room.ForceTargets(sole="contact")}
    whole = {**aimed, "suspension": room.VirtualSuspension()}
    found: dict[str, dict[str, Any]] = {
        NO_PARTS: {},
        ANTICIPATION: {"slip": still},
        PID: {"slip": pid},
        ANTICIPATING_PID: {"slip": room.SlipPid()},
        SUSPENSION: {"suspension": leg_by_leg()},
        S1: {"slip": pid, "suspension": leg_by_leg()},
        TARGETS: aimed,
        TARGETS_SUSPENSION: whole,
        SOLE_UNKNOWN: {**aimed, "force_targets": room.ForceTargets()},
        BOTH_WAYS: {
            **aimed, "force_targets": room.ForceTargets(sole="contact", deviation="target"),
        },
    }  # fmt: skip
    if servo is not None:
        for name, share in WRONG.items():
            found[name] = {**aimed, "servo": servo.stiffer(share)}
    sensing, sensors = room.FootForceSensing, hp.sensors
    noise: dict[str, Any] = {name: sensors.Sensor(noise=size) for name, size in NOISE.items()}
    found[TORQUES] = {**whole, "force": sensing(source="torque", cutoff=CUTOFF)}
    found[CURRENTS] = {
        **whole, "force": sensing(source="current", cutoff=CUTOFF), "delay": LATE,
        "sensors": sensors.Sensors(**noise, delay=LATE, seed=1),
    }  # fmt: skip
    return found


def leg_by_leg() -> hp.foot_control.VirtualSuspension:
    """Return the suspension of S1: each leg yields to its own load, in all modes."""
    return hp.foot_control.VirtualSuspension(heave=1.0, tilt=1.0, warp=1.0)


def named(variant: str, tick: float) -> str:
    """Return the name of a variant at a tick [s]."""
    return f"{variant}, {1e3 * tick:g} ms"


def controls(
    gait: hp.Gait, servo: hp.Servo, ticks: tuple[float, ...], variants: Iterable[str]
) -> dict[str, hp.FootControl]:
    """Return variants at all ticks [s] by `named`; `servo` is that of the robot."""
    given = parts(servo)
    return {
        named(variant, tick): hp.FootControl(gait, period=tick, **given[variant])
        for tick in ticks
        for variant in variants
    }


VARIANTS = (
    NO_PARTS, ANTICIPATION, PID, ANTICIPATING_PID, SUSPENSION, S1, TARGETS, TARGETS_SUSPENSION,
    SOLE_UNKNOWN, BOTH_WAYS, *DISTURBED,
)  # fmt: skip
"""Those of the main part, in the order of tables."""

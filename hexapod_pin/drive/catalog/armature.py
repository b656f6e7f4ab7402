"""The rotor's inertia where nobody has published it: estimated from servos that were identified.

A brushed motor's torque-speed line and its rotor have one time constant, tau = J n^2 v0 / T0, the
mechanical time constant of data sheets (J n^2 rotor inertia at the joint, T0 stall torque, v0
no-load speed). It depends on how the rotor is built more than on its size or the gear. With tau of
identified servos of the same build, J n^2 = tau T0 / v0. Leaving the rotor out would be optimistic.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog.motor_record import MotorRecord

CORELESS_TIME = 0.014
"""Middle of tau of MX-64 and MX-106 (13.6 and 14.5 ms), *assumed* of coreless servos [s]."""

CORED_TIME = 0.037
"""Median of tau of XL-320, XL330-M288 and ST3215 (36, 37, 81 ms), *assumed* of the rest [s]."""


class ArmatureEstimate(NamedTuple):
    """An *assumed* rotor inertia.

    Attributes:
        value: at the joint [kg m^2].
        rule: how it was come by, in words.
    """

    value: float
    rule: str


def mechanical_time(record: MotorRecord) -> float | None:
    """Return tau of a record whose rotor inertia is published [s]; None where one is missing."""
    if record.armature is None or record.no_load_speed is None:
        return None
    return record.armature * record.no_load_speed / record.stall_torque


def estimated_armature(record: MotorRecord) -> ArmatureEstimate:
    """Return the rotor inertia of a motor by the rule above; 0 without a no-load speed."""
    if record.no_load_speed is None:
        return ArmatureEstimate(0.0, "rotor inertia left out: without a no-load speed no estimate")
    coreless = "coreless" in record.motor_type.casefold()
    time = CORELESS_TIME if coreless else CORED_TIME
    value = time * record.stall_torque / record.no_load_speed
    build = "coreless" if coreless else "cored"
    rule = (
        f"rotor inertia at the joint {value:.2g} kg m^2, from the mechanical time constant of "
        f"identified {build} servos, {1e3 * time:.3g} ms"
    )
    return ArmatureEstimate(value, rule)

"""Friction of a gear that grows with the torque it carries and falls with the speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.native import GearFriction as NativeGearFriction


class GearFriction(Spec):
    """Dry friction of a gear by load, direction and speed: models M1 to M6 of BAM.

    With the motor's torque u and the load's torque e at the joint, both counted along the motion,
    and the speed w = |v|, the friction is

        F = Fc + s Fs + |Ke e - Km u| + s |Kes e - Kms u| + s Q,    s = exp(-(w / ws)^a)
        Q = Qe e^2 where the motor drives the load (u > 0 > e), Qm u^2 where the load drives the
            motor (u < 0 < e), else 0

    and acts against the motion; at rest it holds anything up to what it takes once the joint moves.
    The load is what the gear passes on, e = F + c w - u with the gear's viscous friction c: the
    rotor's inertia counts as part of the load. M1 has Fc alone, M2 adds Fs, M3 has Fc and Km = Ke,
    M4 adds Fs and Kms = Kes, M5 has Km, Ke, Kms and Kes apart, M6 adds Qm and Qe.

    Source: M. Duclusaud, G. Passault et al., "Extended Friction Models for the Physics Simulation
    of Servo Actuators", ICRA 2025 (BAM). There e is gravity's torque alone, which is the same
    wherever nothing accelerates.

    Attributes:
        coulomb: Fc [N m].
        stribeck: Fs, added at rest [N m].
        motor: Km, share of the motor's torque [-].
        load: Ke, share of the load's torque [-].
        motor_stribeck: Kms, added to Km at rest [-].
        load_stribeck: Kes, added to Ke at rest [-].
        motor_quadratic: Qm [1/(N m)].
        load_quadratic: Qe [1/(N m)].
        stribeck_speed: ws [rad/s].
        stribeck_exponent: a [-].
    """

    coulomb: NonNegativeFloat = 0.0
    stribeck: NonNegativeFloat = 0.0
    motor: NonNegativeFloat = 0.0
    load: NonNegativeFloat = 0.0
    motor_stribeck: NonNegativeFloat = 0.0
    load_stribeck: NonNegativeFloat = 0.0
    motor_quadratic: NonNegativeFloat = 0.0
    load_quadratic: NonNegativeFloat = 0.0
    stribeck_speed: PositiveFloat = 1.0
    stribeck_exponent: float = Field(default=1.0, ge=0.5, le=20.0)

    @model_validator(mode="after")
    def _passes_torque_on(self) -> GearFriction:
        """Refuse a gear that no torque could turn.

        Raises:
            ParameterError: the shares of one side add up to 0.95 or more.
        """
        for name in ("motor", "load"):
            share = getattr(self, name) + getattr(self, f"{name}_stribeck")
            if share >= LARGEST_SHARE:
                allowed = f"below {LARGEST_SHARE:g} together with {name}_stribeck"
                hint = "Such a gear could not be turned from this side: shares are fractions of 1."
                raise ParameterError(f"GearFriction.{name}", share, allowed, hint)
        return self

    def native(self, viscous: float) -> NativeGearFriction:
        """Return the core's form, with the gear's viscous friction [N m s/rad]."""
        from hexapod_pin.native import GearFriction as NativeGearFriction

        found = NativeGearFriction()
        for name in type(self).model_fields:
            setattr(found, name, getattr(self, name))
        found.viscous = viscous
        return found

    @checked
    def under_motor(self, torque: float, speed: float, *, viscous: float = 0.0) -> float:
        """Return the friction while the motor gives a torque [N m].

        Args:
            torque: of the motor, along the motion; negative: it brakes [N m].
            speed: of the joint, at least 0; 0: what friction holds at most [rad/s].
            viscous: friction of the gear in proportion to the speed [N m s/rad].

        Raises:
            ParameterError: a number is not finite, or speed or viscous friction is negative.
        """
        return self._friction("under_motor", torque, speed, viscous)

    @checked
    def under_load(self, torque: float, speed: float, *, viscous: float = 0.0) -> float:
        """Return the friction while a load drives the joint with a torque [N m].

        Args:
            torque: of the load, along the motion; negative: the load is lifted [N m].
            speed: of the joint, at least 0 [rad/s].
            viscous: friction of the gear in proportion to the speed [N m s/rad].

        Raises:
            ParameterError: a number is not finite, or speed or viscous friction is negative.
        """
        return self._friction("under_load", torque, speed, viscous)

    def _friction(self, method: str, torque: float, speed: float, viscous: float) -> float:
        least = {"torque": -math.inf, "speed": 0.0, "viscous": 0.0}
        for (name, low), value in zip(least.items(), (torque, speed, viscous), strict=True):
            if not (math.isfinite(value) and value >= low):
                allowed = "finite" if name == "torque" else "finite and at least 0"
                raise ParameterError(f"GearFriction.{method}({name})", value, allowed)
        return float(getattr(self.native(viscous), method)(torque, speed)[0])


LARGEST_SHARE = 0.95
"""Sum of the shares of one side from which on a gear is refused [-]."""

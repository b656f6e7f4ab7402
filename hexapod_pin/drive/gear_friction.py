"""Friction of a gear that grows with the torque it carries and falls with the speed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec


class GearFriction(Spec):
    """Dry friction of a gear by load, direction and speed: models M1 to M6 of BAM.

    With the motor's torque u and the load's torque e at the joint, both counted along the motion,
    and the speed w = |v|, the friction is

        F = Fc + s Fs + |Ke e - Km u| + s |Kes e - Kms u| + s Q,    s = exp(-(w / ws)^a)
        Q = Qe e^2 where motor and load oppose each other and the motor prevails (|e| < |u|),
            Qm u^2 where the load does (|e| > |u|), else 0

    and acts against the motion; at rest it holds anything up to what it takes once the joint moves.
    M1 has Fc alone, M2 adds Fs, M3 has Fc and Km = Ke, M4 adds Fs and Kms = Kes, M5 has Km, Ke, Kms
    and Kes apart, M6 adds Qm and Qe.

    By default the load is what the gear passes on, e = F + c w - u with the gear's viscous friction
    c: inertial forces, the rotor's too, count as load. With `external_load` it is, as in BAM, what
    acts on the joint but motor, friction and inertial forces: gravity and velocity forces,
    contacts, pushes and stops. Parameters belong to the load that they were identified with; both
    are the same wherever nothing accelerates. Q jumps where |e| = |u|, which an external load may
    pass while a joint moves: from 0.9 |u| to 1.1 |u| one piece then passes smoothly into the other.

    Source: M. Duclusaud, G. Passault et al., "Extended Friction Models for the Physics Simulation
    of Servo Actuators", ICRA 2025 (BAM).

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
        external_load: whether e is the external torque; else what the gear passes on.
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
    external_load: bool = False

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

    @checked
    def under_motor(self, torque: ArrayLike, speed: ArrayLike, *, viscous: float = 0.0) -> Array:
        """Return the friction while the motor gives a torque [N m]. Shape of the arguments.

        The load is what the gear passes on; where nothing accelerates, that is the external one.

        Args:
            torque: of the motor, along the motion; negative: it brakes [N m].
            speed: of the joint, at least 0; 0: what friction holds at most [rad/s].
            viscous: friction of the gear in proportion to the speed [N m s/rad].

        Raises:
            ParameterError: a number is not finite, or speed or viscous friction is negative.
        """
        u, w = _checked("under_motor", torque, speed, viscous)
        return self._solved(lambda friction: (u, friction + viscous * w - u), w)

    @checked
    def under_load(self, torque: ArrayLike, speed: ArrayLike, *, viscous: float = 0.0) -> Array:
        """Return the friction while a load drives the joint with a torque [N m]. As `under_motor`.

        Args:
            torque: of the load, along the motion; negative: the load is lifted [N m].
            speed: of the joint, at least 0 [rad/s].
            viscous: friction of the gear in proportion to the speed [N m s/rad].

        Raises:
            ParameterError: a number is not finite, or speed or viscous friction is negative.
        """
        e, w = _checked("under_load", torque, speed, viscous)
        return self._solved(lambda friction: (friction + viscous * w - e, e), w)

    def _solved(self, torques: Callable[[Array], tuple[Array, Array]], speed: Array) -> Array:
        """Return F of the formula, given what F makes of motor's and load's torque.

        The formula's slope in F is below `LARGEST_SHARE` everywhere and its pieces are linear or
        quadratic: the secant step from F and its image gains at least a digit a pass.
        """
        fade = np.exp(-((speed / self.stribeck_speed) ** self.stribeck_exponent))
        friction = self._level(*torques(np.zeros_like(speed)), fade)
        for _ in range(MOST_PASSES):
            image = self._level(*torques(friction), fade)
            again = self._level(*torques(image), fade)
            step = image - friction
            slope = np.divide(again - image, step, out=np.zeros_like(step), where=step != 0.0)
            slope = np.clip(slope, -LARGEST_SHARE, LARGEST_SHARE)
            found = friction + step / (1.0 - slope)
            if np.all(np.abs(found - friction) <= ROUND_OFF * (1.0 + np.abs(found))):
                break
            friction = found
        return friction

    def _level(self, motor: Array, load: Array, fade: Array) -> Array:
        """Return what the formula gives for torques along the motion [N m]."""
        slow = np.abs(self.load_stribeck * load - self.motor_stribeck * motor)
        prevails = np.abs(load) < np.abs(motor)
        quadratic = np.where(prevails, self.load_quadratic * load**2, 0.0)
        quadratic += np.where(np.abs(load) > np.abs(motor), self.motor_quadratic * motor**2, 0.0)
        quadratic = np.where(motor * load < 0.0, quadratic, 0.0)
        plain = np.abs(self.load * load - self.motor * motor)
        found: Array = self.coulomb + plain + fade * (self.stribeck + slow + quadratic)
        return found


def _checked(
    method: str, torque: ArrayLike, speed: ArrayLike, viscous: float
) -> tuple[Array, Array]:
    """Return torque and speed as arrays of one shape.

    Raises:
        ParameterError: a number is not finite, or speed or viscous friction is negative.
    """
    where = f"GearFriction.{method}"
    u, w = np.broadcast_arrays(np.asarray(torque, dtype=float), np.asarray(speed, dtype=float))
    for name, value, good in (
        ("torque", u, np.isfinite(u)), ("speed", w, np.isfinite(w) & (w >= 0.0)),
        ("viscous", np.asarray(viscous), np.isfinite(viscous) & (np.asarray(viscous) >= 0.0)),
    ):  # fmt: skip
        if not np.all(good):
            worst = value[~good].flat[0] if value.ndim else value[()]
            allowed = "finite" if name == "torque" else "finite and at least 0"
            raise ParameterError(f"{where}({name})", float(worst), allowed)
    return u, w


MOST_PASSES = 60
"""Of the solution for F; some five are taken."""

ROUND_OFF = 1e-15
"""Change of F that ends it, relative to 1 N m and F."""

Class = Literal["least", "middle", "most"]

ASSUMED: dict[Class, tuple[float, float]] = {
    "least": (0.13, 0.01), "middle": (0.20, 0.02), "most": (0.27, 0.08),
}  # fmt: skip
"""Shares Km = Ke, and Coulomb friction over the motor's own stall torque, of bus servos' gears
(*assumed*): what XL-320, XL330, MX-64 and MX-106, as identified, take of 5 and 20 % of their stall
torque when they lift it at a fifth of their speed."""

LARGEST_SHARE = 0.95
"""Sum of the shares of one side from which on a gear is refused [-]."""

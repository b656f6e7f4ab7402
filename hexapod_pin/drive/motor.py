"""Motors behind the servos: what they can give at a speed, their rotors and their friction."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydantic import NonNegativeFloat, PositiveFloat, model_serializer, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.drive.gear_friction import ASSUMED, Class, GearFriction
from hexapod_pin.drive.winding import assumed_constants
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec, require_factor

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler


AMBIENT = 25.0
"""Temperature of the surroundings where none is given [deg C], *assumed*."""


class Motor(Spec):
    """A DC motor with its gear, seen from the joint.

    Its torque tau lies between the lines -U T0 - T0 v / v0 and U T0 - T0 v / v0 in the joint's rate
    v, T0 the stall torque, v0 the no-load speed, U the voltage ratio: beyond the no-load speed it
    can only brake. The gear loses what its friction takes: `dry_friction`, the same at any load,
    and `gear_friction`, which grows with the load. A line from a data sheet is measured behind the
    gear and has its losses in it; one with `gear_friction` must be the motor's own
    (`hp.drive.identified_drive`).

    Attributes:
        stall_torque: T0, at the joint, at the rated voltage [N m].
        no_load_speed: v0, of the joint, at the rated voltage [rad/s].
        voltage_ratio: U, supply voltage over rated voltage [-].
        rotor_inertia: of the rotor itself, before the gear [kg m^2].
        gear_ratio: turns of the rotor per turn of the joint [-]; the joint is heavier by
            rotor_inertia * gear_ratio^2.
        viscous_friction: of motor and gear, at the joint, added to the URDF's [N m s/rad].
        dry_friction: Coulomb friction of motor and gear, at the joint, added to the URDF's [N m].
        peak_torque: largest torque at any speed, at the joint [N m]; None: no limit of its own.
        gear_friction: dry friction that depends on load and speed, beside `dry_friction`.
        torque_constant: of the motor before the gear [N m/A]; with it a run can record currents.
        winding_resistance: at 25 deg C [ohm]; with it and what follows, temperatures.
        thermal_resistance_winding: from winding to housing [K/W].
        thermal_resistance_housing: from housing to surroundings [K/W].
        thermal_time_winding: time constant of the winding [s].
        thermal_time_housing: time constant of the housing [s].
        ambient: temperature of the surroundings, and of the motor where a run begins [deg C];
            None: 25, *assumed*.
        mass: of motor and gear, by which the unit of its torque is checked, and its heat assumed
            (`warming`) [kg]; the robot's weight is that of its file.

    Raises:
        ParameterError: with a mass: stall torque over mass, or the speed, is none of a geared
            motor; most often it is in another unit, which is named.
    """

    stall_torque: PositiveFloat
    no_load_speed: PositiveFloat
    voltage_ratio: PositiveFloat = 1.0
    rotor_inertia: NonNegativeFloat = 0.0
    gear_ratio: PositiveFloat = 1.0
    viscous_friction: NonNegativeFloat = 0.0
    dry_friction: NonNegativeFloat = 0.0
    peak_torque: PositiveFloat | None = None
    gear_friction: GearFriction | None = None
    torque_constant: PositiveFloat | None = None
    winding_resistance: PositiveFloat | None = None
    thermal_resistance_winding: PositiveFloat | None = None
    thermal_resistance_housing: PositiveFloat | None = None
    thermal_time_winding: PositiveFloat | None = None
    thermal_time_housing: PositiveFloat | None = None
    ambient: float | None = None
    mass: PositiveFloat | None = None

    @model_validator(mode="after")
    def _plausible(self) -> Motor:
        """Refuse a torque that no motor of its mass has.

        Raises:
            ParameterError: see the class.
        """
        if self.mass is not None:
            check_plausible(self.stall_torque, self.mass, self.no_load_speed)
        return self

    @property
    def armature(self) -> float:
        """What the rotor adds to the joint's inertia [kg m^2]."""
        return self.rotor_inertia * self.gear_ratio**2

    @property
    def winding(self) -> tuple[float, ...]:
        """What a run follows the winding by, NaN where it is not known.

        Current per torque of the joint [A/(N m)], resistance at 25 deg C [ohm], thermal
        resistances from winding to housing and to the surroundings [K/W], time constants of
        winding and housing [s], temperature of the surroundings [deg C].
        """
        constant = self.torque_constant
        found = (
            None if constant is None else 1.0 / (constant * self.gear_ratio),
            self.winding_resistance, self.thermal_resistance_winding,
            self.thermal_resistance_housing, self.thermal_time_winding, self.thermal_time_housing,
            AMBIENT if self.ambient is None else self.ambient,
        )  # fmt: skip
        return tuple(math.nan if value is None else float(value) for value in found)

    @checked
    def warming(self, mass: float | None = None, *, ambient: float | None = None) -> Motor:
        """Return the motor with thermal constants *assumed* by its mass (docs/motors.md).

        They are uncertain by a factor of 2. Constants that are given stay.

        Args:
            mass: of the motor with gear and electronics [kg]; None: its own `mass`.
            ambient: as of the class [deg C].

        Raises:
            ParameterError: a mass that is missing or not positive, or a motor without
                `winding_resistance`.
        """
        mass = self.mass if mass is None else mass
        if mass is None:
            raise ParameterError("Motor.warming.mass", mass, "given where the motor has none [kg]")
        if self.winding_resistance is None:
            raise ParameterError("Motor.winding_resistance", None, "given where a motor warms")
        found = assumed_constants(require_factor(mass, "mass"))
        names = (
            "thermal_resistance_winding", "thermal_resistance_housing", "thermal_time_winding",
            "thermal_time_housing",
        )  # fmt: skip
        guess = dict(zip(names, found, strict=True))
        changes = {name: x for name, x in guess.items() if getattr(self, name) is None}
        given = {} if ambient is None else {"ambient": float(ambient)}
        return self.model_copy(update={**changes, **given})

    @checked
    def with_assumed_gear(self, of: Class = "middle") -> Motor:
        """Return the motor with gear friction *assumed*, for servos that nobody identified.

        The line is taken for one measured behind the gear: it becomes the motor's own, which the
        gear brings back to the same stall torque and no-load speed. With F = c u0 + K (|e| + u) the
        own stall torque u0 is T0 (1 + K) / (1 - K - c), the own no-load speed
        v0 / (1 - c / (1 - K)).

        Args:
            of: which end of the class: "least", "middle" or "most" friction (docs/drive.md).

        Raises:
            ParameterError: the motor has gear friction already.
        """
        if self.gear_friction is not None:
            raise ParameterError("Motor.gear_friction", self.gear_friction, "None: none is assumed")
        share, level = ASSUMED[of]
        own = self.stall_torque * (1.0 + share) / (1.0 - share - level)
        gear = GearFriction(coulomb=level * own, motor=share, load=share, external_load=True)
        speed = self.no_load_speed / (1.0 - level / (1.0 - share))
        changes = {"stall_torque": own, "no_load_speed": speed, "gear_friction": gear}
        return self.model_copy(update=changes)

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}


# What a geared motor can be. The catalogue has 17 to 78 N m/kg and at most 13 rad/s; quasi-direct
# drives have some 40 N m/kg and 30 rad/s.

TORQUE_BY_MASS = (2.0, 120.0)
"""Stall torque over mass, from which to which [N m/kg] (*assumed*)."""

USUAL_BY_MASS = 37.0
"""Middle of the catalogue [N m/kg]: which unit was meant."""

HIGHEST_SPEED = 100.0
"""Of a joint's motor without load [rad/s] (*assumed*)."""

TORQUE_UNITS = {
    "N mm": 1e-3, "N cm": 1e-2, "kgf cm": 0.0980665, "kgf mm": 0.00980665, "ozf in": 0.00706155,
}  # fmt: skip
"""What data sheets give torques in, in N m."""


MOTORS_SHARE = 1.5
"""Mass of all motors over that of the robot with its payload, at most [-] (*assumed*).

Above 1 for files that leave the motors out."""


def most_torque(mass: float, count: int) -> float:
    """Return the stall torque [N m] of motors that weigh `MOTORS_SHARE` of a robot.

    Args:
        mass: of the robot with its payload [kg].
        count: of its motors.
    """
    return TORQUE_BY_MASS[1] * MOTORS_SHARE * mass / count


def unit_meant(stall: float, ratio: float, usual: float, **others: float) -> tuple[str, float]:
    """Return the unit that a stall torque was perhaps meant in, as text, and what then comes of it.

    Args:
        stall: as it was given.
        ratio: what makes it implausible, such as torque over mass, with the torque in N m.
        usual: what that ratio usually is.
        others: text -> the ratio, of other mistakes than the torque's unit.
    """
    meant = {f"{stall:g} {unit}": to * ratio for unit, to in TORQUE_UNITS.items()} | others
    near = min(meant, key=lambda text: abs(math.log(meant[text] / usual)))
    return near, meant[near]


def check_plausible(stall: float, mass: float | None, speed: float | None) -> None:
    """Refuse numbers of a geared motor that are in another unit.

    Args:
        stall: stall torque at the joint [N m].
        mass: of the motor with its gear [kg]; None: not known, its torque is not judged.
        speed: no-load speed at the joint [rad/s]; None: not known.

    Raises:
        ParameterError: torque over mass, or the speed, is not one of a geared motor.
    """
    low, high = TORQUE_BY_MASS
    if mass is not None and not low <= stall / mass <= high:
        ratio = stall / mass
        grams = {f"a mass of {mass:g} g": 1e3 * ratio}
        near, meant = unit_meant(stall, ratio, USUAL_BY_MASS, **grams)
        allowed = f"{low:g} to {high:g} N m for each kg of the motor's {mass:g} kg"
        hint = "Check its unit, and that of the mass."
        if low <= meant <= high:
            hint = f"Perhaps it is {near}: that would be {meant:.3g} N m/kg."
        raise ParameterError("stall_torque", stall, allowed, hint)
    if speed is not None and speed > HIGHEST_SPEED:
        hint = f"Perhaps it is in rpm: {speed:g} rpm are {speed * math.pi / 30.0:.3g} rad/s."
        allowed = f"at most {HIGHEST_SPEED:g} rad/s, behind the gear"
        raise ParameterError("no_load_speed", speed, allowed, hint)

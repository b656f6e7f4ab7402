"""A record is one motor at one voltage, as its data sheet states it.

Derating is the part of it for a lasting use; an unpublished rotor inertia is estimated.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    ValidationInfo,
    field_validator,
    model_validator,
)

from hexapod_pin.drive.motor import Motor, check_plausible, unit_meant
from hexapod_pin.errors import ParameterError
from hexapod_pin.foreign_text import has_control
from hexapod_pin.spec import Spec


class MotorRecord(Spec):
    """A motor with its gear at one voltage; torques and speeds are those of the joint.

    What a data sheet does not give is None: nothing is computed from other columns. The one number
    that may be estimated is the rotor's inertia, which `assumed` then reports.

    Attributes:
        model: name of the maker's model, such as "XM430-W350".
        maker: the manufacturer.
        motor_type: "cored", "coreless", "brushless", ...
        bus: how it is commanded: "TTL", "RS-485", "PWM", "CAN", or several with slashes between.
        voltage: supply at which the row's numbers hold [V].
        voltage_min: smallest supply the motor is made for [V].
        voltage_max: largest supply the motor is made for [V].
        stall_torque: largest torque at rest [N m].
        no_load_speed: speed without load [rad/s].
        stall_current: current at the stall torque [A].
        standby_current: current of the electronics alone [A].
        rated_torque: torque allowed for ever, where the maker publishes one [N m].
        mass: of motor, gear and electronics [kg].
        gear_ratio: turns of the rotor per turn of the joint [-].
        armature: inertia of the rotor, seen from the joint [kg m^2].
        armature_source: where that is from.
        price: of one motor, in `currency`.
        currency: of the price.
        price_date: when it was read, as YYYY-MM-DD.
        price_source: where it was read.
        winding_resistance: at 25 deg C [ohm].
        torque_constant: of the motor before the gear [N m/A].
        thermal_resistance_winding: from winding to housing [K/W].
        thermal_resistance_housing: from housing to surroundings [K/W].
        thermal_time_winding: time constant of the winding [s].
        thermal_time_housing: time constant of the housing [s].
        winding_temperature_max: the highest of the winding [deg C].
        source: where the row's numbers are from.
        note: anything to know of the row.
        uncertain: why the published numbers are not to be trusted; else empty.
    """

    model: str
    maker: str = ""
    motor_type: str = ""
    bus: str = ""
    voltage: PositiveFloat
    voltage_min: PositiveFloat | None = None
    voltage_max: PositiveFloat | None = None
    stall_torque: PositiveFloat
    no_load_speed: PositiveFloat | None = None
    stall_current: PositiveFloat | None = None
    standby_current: NonNegativeFloat | None = None
    rated_torque: PositiveFloat | None = None
    mass: PositiveFloat | None = None
    gear_ratio: PositiveFloat | None = None
    armature: NonNegativeFloat | None = None
    armature_source: str = ""
    price: NonNegativeFloat | None = None
    currency: str = ""
    price_date: str = ""
    price_source: str = ""
    winding_resistance: PositiveFloat | None = None
    torque_constant: PositiveFloat | None = None
    thermal_resistance_winding: PositiveFloat | None = None
    thermal_resistance_housing: PositiveFloat | None = None
    thermal_time_winding: PositiveFloat | None = None
    thermal_time_housing: PositiveFloat | None = None
    winding_temperature_max: float | None = None
    source: str = ""
    note: str = ""
    uncertain: str = ""

    @field_validator("*")
    @classmethod
    def _printable(cls, value: Any, about: ValidationInfo) -> Any:
        """Refuse a text that a terminal would act on, and a model's name of several lines.

        Raises:
            ParameterError: it has control characters.
        """
        if isinstance(value, str):
            if has_control(value):
                raise ParameterError(
                    str(about.field_name), value, "text without control characters"
                )
            if about.field_name == "model" and any(mark in value for mark in "\n\t"):
                raise ParameterError("model", value, "one line, without tabs")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> MotorRecord:
        """Refuse what cannot be of one motor.

        Raises:
            ParameterError: an empty name, a voltage outside its range, a rated torque above the
                stall torque, a torque for its mass or a speed that no geared motor has, an armature
                without source, or a price without currency.
        """
        low, high = self.voltage_min or 0.0, self.voltage_max or float("inf")
        if not self.model.strip():
            raise ParameterError("model", self.model, "the name of a motor")
        if not low <= self.voltage <= high:
            allowed = f"from voltage_min {low:g} to voltage_max {high:g} V"
            raise ParameterError("voltage", self.voltage, allowed)
        if self.rated_torque is not None and self.rated_torque > self.stall_torque:
            allowed = f"at most the stall torque, {self.stall_torque:g} N m"
            raise ParameterError("rated_torque", self.rated_torque, allowed)
        check_plausible(self.stall_torque, self.mass, self.no_load_speed)
        if self.no_load_speed is not None and self.stall_current is not None:
            power = self.voltage * self.stall_current
            _check_power(self.stall_torque, self.no_load_speed, power)
        if self.armature is not None and not self.armature_source.strip():
            hint = 'Write "measured", a page, or leave the armature empty.'
            raise ParameterError("armature_source", "", "where the armature is from", hint)
        if self.price is not None and not self.currency.strip():
            raise ParameterError("currency", "", "the price's currency", 'Such as "EUR".')
        return self

    @property
    def name(self) -> str:
        """Name of the row, unique in a catalogue, such as "AX-12A at 12 V"."""
        return f"{self.model} at {self.voltage:g} V"

    @property
    def buses(self) -> tuple[str, ...]:
        """The buses it can be had with; empty where none is known."""
        return tuple(name.strip() for name in self.bus.split("/") if name.strip())

    @property
    def implied_efficiency(self) -> float | None:
        """Stall torque over stall current times no-load speed over voltage [-].

        Of a linear DC motor it is the gear's efficiency (torque constant over speed constant); it
        serves to find rows whose numbers are not of one such motor and nothing else. None where a
        number is missing.
        """
        if self.no_load_speed is None or self.stall_current is None:
            return None
        return self.stall_torque / self.stall_current * self.no_load_speed / self.voltage

    @property
    def flags(self) -> tuple[str, ...]:
        """A sentence on each fault of the row and each missing number."""
        found = []
        efficiency = self.implied_efficiency
        if efficiency is not None and efficiency > 1.0:
            found.append(
                f"inconsistent: stall torque {self.stall_torque:g} N m, stall current "
                f"{self.stall_current:g} A and no-load speed {self.no_load_speed:.4g} rad/s imply "
                f"an efficiency of {efficiency:.2f}: they are not of one linear motor"
            )
        if self.uncertain:
            found.append(f"uncertain: {self.uncertain}")
        found += [f"no {name} is known" for name in self._missing()]
        return tuple(found)

    def _missing(self) -> list[str]:
        wanted = {
            "no-load speed": self.no_load_speed,
            "mass": self.mass,
            "stall current": self.stall_current,
            "source": self.source or None,
        }
        return [name for name, value in wanted.items() if value is None]

    @property
    def unusable(self) -> str | None:
        """Why the motor cannot be chosen for a robot; None where it can."""
        lacks = []
        if self.no_load_speed is None:
            lacks.append("no no-load speed is known, so there is no torque-speed line")
        if self.mass is None:
            lacks.append("no mass is known, so its effect on the robot's mass is not either")
        return "; ".join(lacks) or None

    @property
    def assumed(self) -> tuple[str, ...]:
        """A sentence on each number of `motor()` that is not published for this motor."""
        if self.armature is not None:
            return ()
        return (estimated_armature(self).rule,)

    @property
    def joint_armature(self) -> float:
        """Inertia of the rotor at the joint, estimated where none is published [kg m^2]."""
        return estimated_armature(self).value if self.armature is None else self.armature

    def motor(self, voltage_ratio: float = 1.0) -> Motor:
        """Return the motor for a servo: torque-speed line, rotor and winding of the row.

        The line goes through stall torque and no-load speed alone, never through a torque constant
        and a winding resistance computed from currents; these serve for what a run records.

        Args:
            voltage_ratio: supply over `voltage` [-].

        Raises:
            ParameterError: no no-load speed is known, or the ratio is not positive.
        """
        if self.no_load_speed is None:
            raise ParameterError(
                "MotorRecord.no_load_speed", None, f"known of {self.name} [rad/s]",
                "Write it into a catalogue of your own, or choose another motor.",
            )  # fmt: skip
        ratio = self.gear_ratio or 1.0
        return Motor(
            stall_torque=self.stall_torque,
            no_load_speed=self.no_load_speed,
            voltage_ratio=voltage_ratio,
            rotor_inertia=self.joint_armature / ratio**2,
            gear_ratio=ratio,
            torque_constant=None if self.gear_ratio is None else self.torque_constant,
            winding_resistance=self.winding_resistance,
            mass=self.mass,
            thermal_resistance_winding=self.thermal_resistance_winding,
            thermal_resistance_housing=self.thermal_resistance_housing,
            thermal_time_winding=self.thermal_time_winding,
            thermal_time_housing=self.thermal_time_housing,
        )


# A motor gives no more power than it takes.

LARGEST_POWER_RATIO = 3.0
"""Stall torque times no-load speed over what the motor draws at a stall, at most [-].

Of a DC motor without losses it is 1, as the torque constant is the voltage constant; losses of the
gear lower it. The catalogue has 0.39 to 1.28: data sheets round."""


def _check_power(stall: float, speed: float, power: float) -> None:
    """Refuse a torque or a speed that is in another unit, by the power drawn at a stall [W].

    Raises:
        ParameterError: the motor would give more power than it takes.
    """
    ratio = stall * speed / power
    if ratio <= LARGEST_POWER_RATIO:
        return
    rpm = {f"a speed of {speed:g} rpm": ratio * math.pi / 30.0} if speed > SLOW_SPEED else {}
    near, _ = unit_meant(stall, ratio, USUAL_POWER_RATIO, **rpm)
    allowed = f"at most {LARGEST_POWER_RATIO * power / speed:.3g} N m at this speed and current"
    raise ParameterError("stall_torque", stall, allowed, f"Perhaps it is {near}.")


SLOW_SPEED = 15.0
"""Up to which a servo's speed is in rad/s: in rpm hardly one is so slow."""

USUAL_POWER_RATIO = 0.7
"""Middle of the catalogue [-]: which unit was meant."""


# The rotor's inertia where nobody has published it: estimated from servos that were identified.
#
# A brushed motor's torque-speed line and its rotor have one time constant, tau = J n^2 v0 / T0, the
# mechanical time constant of data sheets (J n^2 rotor inertia at the joint, T0 stall torque, v0 no-
# load speed). It depends on how the rotor is built more than on its size or the gear. With tau of
# identified servos of the same build, J n^2 = tau T0 / v0. Leaving the rotor out would be
# optimistic.

CORELESS_TIME = 0.014
"""Middle of tau of MX-64 and MX-106 (13.6 and 14.5 ms), *assumed* of coreless servos [s]."""

CORED_TIME = 0.037
"""Median of tau of XL-320, XL330-M288 and STS3215 (36, 37, 81 ms), *assumed* of the rest [s]."""


class ArmatureEstimate(NamedTuple):
    """An *assumed* rotor inertia.

    Attributes:
        value: at the joint [kg m^2].
        rule: a sentence on its source.
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


# Derating: the part of a motor's data sheet that a lasting, reliable use may require.

Share = Annotated[float, Field(gt=0.0, le=1.0)]

STALL_FIFTH = (
    "continuous 0.2: ROBOTIS states for AX-12A, AX-18A and XL-320 that the stall torque is the "
    "largest instantaneous and static torque, and that motion is stable when a robot is designed "
    "for loads of 1/5 or less of it (e-Manual, emanual.robotis.com/docs/en/dxl/ax/ax-12a)"
)
FEETECH_TEST = (
    "continuous 0.2 is cautious for servos with metal gears: a Feetech STS3215 (30 kgf cm) held "
    "half of its stall torque for over an hour at 48 deg C, cut out at 0.67 of it, and came to "
    "71 deg C in 110 min of swinging (github.com/TheRobotStudio/SO-ARM100/issues/134)"
)
HOT_END = (
    "continuous 0.2 for all makers: with assumed thermal constants at the hot end of their spread "
    "the catalogue's windings come to 100 deg C at 0.16 to 0.40 of stall, median 0.25 "
    "(docs/motors.md)"
)
PEAK_CURVE = (
    "peak 0.8 *assumed*: ROBOTIS measures its performance graphs with a slowly rising load and "
    "states that their largest torque lies below the stall torque (e-Manual); by how much differs "
    "from model to model"
)
SAGGING_BATTERY = (
    "voltage 0.9 *assumed*: a lithium cell of 3.7 V nominal is at 3.3 to 3.4 V under load near "
    "the end of its charge"
)


class Derating(Spec):
    """Shares of a motor's published numbers that may be used; all defaults can be changed.

    Attributes:
        peak: largest torque over the torque of the motor's line at that speed [-].
        continuous: torque that may last for ever over stall torque, of every maker's motors [-].
        voltage: supply under load over the record's voltage [-].
    """

    peak: Share = 0.8
    continuous: Share = 0.2
    voltage: Share = 0.9

    @property
    def evidence(self) -> tuple[str, ...]:
        """What the values rest on; of values that were changed: that the user stated them."""
        default = Derating()
        grounds = {
            "peak": (PEAK_CURVE,),
            "continuous": (STALL_FIFTH, HOT_END, FEETECH_TEST),
            "voltage": (SAGGING_BATTERY,),
        }
        lines: list[str] = []
        for name, texts in grounds.items():
            value = getattr(self, name)
            stated = (f"{name} {value:g}: stated by the user",)
            lines += texts if value == getattr(default, name) else stated
        return tuple(lines)

    def continuous_torque(self, record: MotorRecord) -> float:
        """Return the RMS torque that may last for ever [N m]: `continuous` of the stall torque.

        One share for all makers: their own ratings (`MotorRecord.rated_torque`) rest on different
        tests. It is set by heat, so a sagging battery does not change it.
        """
        return self.continuous * record.stall_torque

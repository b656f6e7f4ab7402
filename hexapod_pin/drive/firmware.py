"""Position control inside a bus servo, from its registers: PID, encoder, dead band, limits."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

LOOP_PERIOD = 1e-3
"""Time between two passes of a servo's position loop [s], *assumed*: makers do not publish it."""

FULL_PWM = 885
"""Register value of the whole supply voltage of Dynamixel X and MX (2.0): 0.113 % per unit."""

LARGEST_GAIN = 16_383
"""Of Dynamixel's position gains [-]."""

CURRENT_UNIT = {"MX-64": 3.36e-3, "MX-106": 3.36e-3, "XM430": 2.69e-3, "XM540": 2.69e-3}
"""Current per unit of the register Current Limit [A], by series (ROBOTIS e-Manual)."""

FEETECH_DUTY = 0.166
"""Duty cycle per unit of the register P and rad of error, of an STS3215 [1/rad]: measured with an
oscilloscope by Rhoban (BAM, `bam/feetech/actuator.py`)."""

FEETECH_LARGEST_DUTY = 0.97
"""Largest duty cycle of an STS3215 [-], measured likewise."""

LARGEST_REGISTER = 254
"""Of one byte of a Feetech memory table [-]."""


class Firmware(Spec):
    """The position loop of a bus servo: at every pass it sets the duty cycle of the motor's bridge.

    With the error e, of set-point and angle in whole counts of the encoder, once in `period`:

        duty = P d(e) + I sum(e period) + D (e - e_before) / period,   d(e) = 0 where |e| <= dead
        band, else e; limited to +-duty_limit

    The motor gives duty T0 - T0 v / v0 until the next pass, T0 its stall torque at the supply's
    voltage: the duty cycle is a voltage, and the back-EMF acts between the passes, too. The sum
    stops growing in the direction in which the duty cycle is limited, and inside the dead band
    (*assumed*: makers do not publish how their integral is kept from winding up).

    `hp.FirmwareControl` runs it in a simulation; `servo` gives the continuous equivalent.

    Attributes:
        proportional: P, duty cycle per error [1/rad].
        integral: I [1/(rad s)].
        derivative: D [s/rad].
        counts: of the encoder per turn of the joint [-].
        dead_band: largest error that counts as none, on either side [counts].
        duty_limit: largest duty cycle [-].
        current_limit: of the motor [A]; None: no limit of its own.
        period: time between two passes [s]; the default is *assumed*.
        delay: from the reading of the encoder until the duty cycle acts [s]; *assumed* 0.
        temperature_limit: of the motor's housing, where the servo's sensor is *assumed* to be;
            above it the firmware cuts the torque for good [deg C]. None: no such limit. Dynamixel's
            register Temperature Limit (31) holds 80 as delivered (MX, X series; e-Manual).
    """

    proportional: NonNegativeFloat
    integral: NonNegativeFloat = 0.0
    derivative: NonNegativeFloat = 0.0
    counts: PositiveInt = 4096
    dead_band: int = Field(default=0, ge=0, le=4096)
    duty_limit: float = Field(default=1.0, gt=0.0, le=1.0)
    current_limit: PositiveFloat | None = None
    period: PositiveFloat = LOOP_PERIOD
    delay: NonNegativeFloat = 0.0
    temperature_limit: float | None = None

    @classmethod
    def dynamixel(
        cls, p: int, i: int = 0, d: int = 0, *, pwm_limit: int = FULL_PWM,
        current_limit: float | None = None, period: float = LOOP_PERIOD, delay: float = 0.0,
        temperature_limit: float | None = None,
    ) -> Firmware:  # fmt: skip
        """Return the loop of a Dynamixel of protocol 2 (X series, MX 2.0) in position mode.

        KPP = p / 128, KPI = i / 65536 and KPD = d / 16 act on counts of 1/4096 turn, once a pass,
        and give PWM units, of which 885 are the whole voltage. The constants contain the sampling
        time: I and D per second follow from `period`. The feed-forward gains are 0, as delivered.

        Source: ROBOTIS e-Manual, "Position PID Gain (80, 82, 84)" and "PWM Limit (36)". XL330
        behaves as if the P gain were divided by 256 (BAM, `bam/dynamixel/actuator.py`): halve p.

        Args:
            p: register 84 [-].
            i: register 82 [-].
            d: register 80 [-].
            pwm_limit: register 36 [-].
            current_limit: Current Limit (38) times its unit (`CURRENT_UNIT`) [A].
            period: of the loop [s], *assumed*.
            delay: of the loop [s].
            temperature_limit: Temperature Limit (31) [deg C]; None: no such limit.

        Raises:
            ParameterError: a register or a number out of range.
        """
        for name, value, most in (
            ("p", p, LARGEST_GAIN), ("i", i, LARGEST_GAIN), ("d", d, LARGEST_GAIN),
            ("pwm_limit", pwm_limit, FULL_PWM),
        ):  # fmt: skip
            _require_register(f"Firmware.dynamixel.{name}", value, most, name == "pwm_limit")
        step = _positive("Firmware.dynamixel.period", period)
        duty = 4096.0 / (2.0 * math.pi) / FULL_PWM  # per rad of error and unit of gain
        return cls(
            proportional=p / 128.0 * duty, integral=i / 65536.0 * duty / step,
            derivative=d / 16.0 * duty * step, duty_limit=pwm_limit / FULL_PWM,
            current_limit=current_limit, period=period, delay=delay,
            temperature_limit=temperature_limit,
        )  # fmt: skip

    @classmethod
    def feetech(
        cls, p: int, *, dead_zone: int = 0, duty_limit: float = FEETECH_LARGEST_DUTY,
        current_limit: float | None = None, period: float = LOOP_PERIOD, delay: float = 0.0,
        temperature_limit: float | None = None,
    ) -> Firmware:  # fmt: skip
        """Return the loop of a Feetech STS servo in position mode, of its P gain alone.

        The scale of P was measured (BAM); those of the registers D and I (22, 23) are not
        published, so that they cannot be given.

        Args:
            p: register 21 [-].
            dead_zone: registers 26 and 27 [counts of 1/4096 turn].
            duty_limit: largest duty cycle [-].
            current_limit: of the motor [A].
            period: of the loop [s], *assumed*.
            delay: of the loop [s].
            temperature_limit: Max Temperature Limit (13) [deg C]; None: no such limit.

        Raises:
            ParameterError: a register or a number out of range.
        """
        _require_register("Firmware.feetech.p", p, LARGEST_REGISTER)
        _require_register("Firmware.feetech.dead_zone", dead_zone, 32)
        return cls(
            proportional=FEETECH_DUTY * p, dead_band=dead_zone, duty_limit=duty_limit,
            current_limit=current_limit, period=period, delay=delay,
            temperature_limit=temperature_limit,
        )  # fmt: skip

    @checked
    def gains(self, motor: Motor) -> tuple[float, float]:
        """Return what P and D are at the joint: kp [N m/rad] and kd [N m s/rad].

        The motor's back-EMF, which resists like T0 / v0 [N m s/rad], is not in kd.

        Args:
            motor: with its supply's voltage.
        """
        stall = motor.stall_torque * motor.voltage_ratio
        return stall * self.proportional, stall * self.derivative

    @checked
    def limited(self, motor: Motor) -> Motor:
        """Return a motor that gives no more than the loop's duty cycle and current permit.

        Args:
            motor: without these limits.

        Raises:
            ParameterError: a current limit, and a motor whose torque constant is not known.
        """
        changes: dict[str, float] = {"voltage_ratio": motor.voltage_ratio * self.duty_limit}
        if self.current_limit is not None:
            if motor.torque_constant is None:
                raise ParameterError(
                    "Firmware.current_limit", self.current_limit,
                    "None with a motor whose torque_constant is not known",
                )  # fmt: skip
            torque = self.current_limit * motor.torque_constant * motor.gear_ratio
            changes["peak_torque"] = min(torque, motor.peak_torque or math.inf)
        return motor.model_copy(update=changes)

    @checked
    def servo(self, motor: Motor | Mapping[str, Motor], *, limited: bool = True) -> Servo:
        """Return the continuous equivalent: a PD servo with the loop's gains and limits.

        kd is D's plus the back-EMF's T0 / v0. Of the rate of the set-points the servo thus takes
        the back-EMF's part as well, as a feed-forward that makes up for it would. There is no
        integral, no dead band and no quantisation in it.

        Args:
            motor: one for all joints that turn; or by kind or name of joint, with all of them.
            limited: as of `Servo`.

        Raises:
            ParameterError: a current limit, and a motor whose torque constant is not known.
        """
        return self._servo(motor, self.proportional, self.derivative, limited)

    @checked
    def driven(self, motor: Motor | Mapping[str, Motor], *, limited: bool = True) -> Servo:
        """Return the drives that `hp.FirmwareControl` commands: back-EMF and limits alone.

        Args:
            motor: as of `servo`.
            limited: as of `Servo`.

        Raises:
            ParameterError: a current limit, and a motor whose torque constant is not known.
        """
        return self._servo(motor, 0.0, 0.0, limited)

    def _servo(
        self, motor: Motor | Mapping[str, Motor], p: float, d: float, limited: bool
    ) -> Servo:
        """Return a servo with gains of P [1/rad] and D [s/rad] and the back-EMF."""
        if isinstance(motor, Motor):
            kp, kd = _at_joint(motor, p, d)
            return Servo(kp=kp, kd=kd, limited=limited, motor=self.limited(motor))
        gains = {name: _at_joint(one, p, d) for name, one in motor.items()}
        return Servo(
            kp={name: pair[0] for name, pair in gains.items()},
            kd={name: pair[1] for name, pair in gains.items()}, limited=limited,
            motor={name: self.limited(one) for name, one in motor.items()},
        )  # fmt: skip

    def rounded(self, angle: Array) -> Array:
        """Return angles in whole counts of the encoder [counts]. Shape of the argument."""
        found: Array = np.round(angle * (self.counts / (2.0 * math.pi)))
        return found

    def duty(self, error: Array, before: Array, total: Array) -> tuple[Array, Array]:
        """Return the duty cycle of one pass and the sum of the integral after it.

        Args:
            error: of this pass [counts].
            before: of the pass before [counts].
            total: of the errors so far, times `period` [counts s]. One shape for all.
        """
        count = 2.0 * math.pi / self.counts
        counted = np.where(np.abs(error) > self.dead_band, error, 0.0)
        direct = self.proportional * counted + self.derivative / self.period * (error - before)
        grown = total + self.period * counted
        wanted = count * (direct + self.integral * grown)
        held = (np.abs(wanted) > self.duty_limit) & (wanted * counted > 0.0)
        grown = np.where(held, total, grown)
        wanted = count * (direct + self.integral * grown)
        return np.clip(wanted, -self.duty_limit, self.duty_limit), grown


def _at_joint(motor: Motor, p: float, d: float) -> tuple[float, float]:
    """Return kp and kd of duty cycles per error [1/rad] and rate [s/rad], back-EMF included."""
    stall = motor.stall_torque * motor.voltage_ratio
    return stall * p, stall * d + motor.stall_torque / motor.no_load_speed


def _require_register(name: str, value: int, most: int, positive: bool = False) -> None:
    """Refuse what a register cannot hold.

    Raises:
        ParameterError: it is no whole number from 0 (or 1) to `most`.
    """
    least = 1 if positive else 0
    if not least <= value <= most:
        raise ParameterError(name, value, f"a whole number from {least} to {most}")


def _positive(name: str, value: float) -> float:
    """Return a number above 0.

    Raises:
        ParameterError: it is not, or not finite.
    """
    if not (math.isfinite(value) and value > 0.0):
        raise ParameterError(name, value, "finite and above 0")
    return float(value)

"""Motors on one battery: sag, currents, temperatures and what is left of a duty cycle's torque.

At the start of a pass, with duty cycles d, joint rates w and temperatures known,

    i = (R_25 / R) (d u T0 - m S w) / k        of each motor, within its current limit
    u V = U_open - r (I_standby + sum of d i)

are solved together for the share u of the full voltage V: the sum of the currents acts back on
every motor's line within the pass. T0 is the stall torque at V, S the line's slope, k the torque
per current at the joint, m k the same with warm magnets, R_25 / R the fall of the current with the
copper's temperature. A motor at its current limit takes the power R i^2 + m k i w, thus less
current from the bus than its own. Temperatures follow the two thermal bodies (`winding.py`) under
the mean of i^2 of the pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.drive.battery import Battery
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.winding import MAGNET, REFERENCE, Winding, flux, warmed
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

ITERATIONS = 80
"""Of the voltage at most: Newton's method, and bisection where that leaves its bracket."""

CLOSE = 1e-14
"""Share of the full voltage to which it is found [-]."""

Memory = dict[str, Any]


@dataclass(frozen=True)
class SupplyCourse(Immutable):
    """Battery and motors of n joints at the passes of a run.

    Attributes:
        joint_names: n names.
        time: of the passes [s]. Shape (T,).
        voltage: at the motors; NaN without a battery, as of the next two [V]. Shape (T,).
        current: out of the battery [A]. Shape (T,).
        drawn: charge since the start [C]. Shape (T,).
        motor_current: of each motor, as the pass begins; NaN where it is not known [A]. (T, n).
        winding: temperature; NaN where it is not followed [deg C]. Shape (T, n).
        housing: likewise [deg C]. Shape (T, n).
        shut_down: whether the firmware has cut the torque for its temperature. Shape (T, n).
    """

    joint_names: tuple[str, ...]
    time: Array
    voltage: Array
    current: Array
    drawn: Array
    motor_current: Array
    winding: Array
    housing: Array
    shut_down: NDArray[np.bool_]

    @property
    def line(self) -> str:
        """The lowest voltage, the largest current and the hottest housing in one line."""
        text = "no battery"
        if not np.isnan(self.voltage).any():
            least, most = int(np.argmin(self.voltage)), float(self.current.max())
            text = f"battery {self.voltage[least]:.3g} V at least (at {self.time[least]:.3g} s), "
            text += f"{most:.3g} A at most"
        if not np.isnan(self.housing).all():
            warm = np.where(np.isnan(self.housing), -np.inf, self.housing).max(axis=0)
            hottest = self.joint_names[int(np.argmax(warm))]
            text += f", {hottest}'s housing up to {warm.max():.3g} degC"
        off = [name for name, out in zip(self.joint_names, self.shut_down[-1], strict=True) if out]
        return f"{text}; shut down: {', '.join(off)}" if off else text


class SuppliedDrives:
    """The motors of n joints on a battery, or on a constant supply where there is none.

    What changes stands in a memory of arrays, whose first axis is that of runs in lock-step (B).
    """

    def __init__(
        self, names: Sequence[str], motors: Sequence[Motor | None], stall: Array, cap: Array,
        battery: Battery | None, heat: bool, temperature_limit: float | None,
    ) -> None:  # fmt: skip
        """Take the motors.

        Args:
            names: of the n joints.
            motors: of the joints, None where there is none.
            stall: their stall torques at the full voltage (n,) [N m].
            cap: largest torques at any speed (n,), infinite where there is none [N m].
            battery: on which all of them are; None: a supply that keeps its voltage.
            heat: whether temperatures are followed, and act.
            temperature_limit: of the housing, at which the firmware cuts the torque [deg C].

        Raises:
            ParameterError: a motor lacks a constant that battery or heat need.
        """
        self.battery, self.heat, self._limit = battery, heat, temperature_limit
        self._driven = np.array([motor is not None for motor in motors])
        self._stall = np.where(self._driven, stall, 0.0)
        self._slope = np.array([m.stall_torque / m.no_load_speed if m else 0.0 for m in motors])
        constants = np.array([m.winding if m else (np.nan,) * 7 for m in motors])
        if battery is not None or heat:
            _require(names, constants[:, :1], self._driven, "torque_constant")
        if heat:
            needed = "winding_resistance and thermal constants, such as Motor.warming gives"
            _require(names, constants, self._driven, needed)
        self._known = ~np.isnan(constants[:, 0])
        self._per_current = 1.0 / np.where(self._known, constants[:, 0], 1.0)  # N m/A
        _, *thermal, ambient = np.where(np.isnan(constants), 1.0, constants).T
        self._winding = replace(Winding(*thermal), magnet=MAGNET)
        self._ambient = np.where(self._driven, ambient, REFERENCE)
        self._most_torque = cap
        self._most = cap / self._per_current

    def start(self, batch: int) -> Memory:
        """Return the memory before the first pass: full voltage, motors as warm as around them."""
        rows = np.zeros((batch, len(self._stall)))
        warm = np.broadcast_to(self._ambient[:, None], (batch, len(self._stall), 2))
        return {
            "drawn": np.zeros(batch), "share": np.ones(batch), "duty": rows, "heat": warm.copy(),
            "speed": rows.copy(), "off": np.zeros(rows.shape, dtype=bool),
        }  # fmt: skip

    def command(self, duty: Array, speed: Array, memory: Memory, step: float) -> tuple[
        Array, Array, Memory
    ]:  # fmt: skip
        """Return what the drives are commanded at a pass, and the memory after it.

        Args:
            duty: wanted duty cycles (B, n) [-].
            speed: of the joints now (B, n) [rad/s].
            memory: after the pass before.
            step: since the pass before [s]; 0 at the first.

        Returns:
            Torques (B, n) [N m] and set-points of the rate (B, n) [rad/s] of drives that resist
            their rate by the cold line's slope.
        """
        memory = self._passed(speed, memory, step)
        duty = np.where(memory["off"], 0.0, duty)
        heat = memory["heat"]
        share = self._share(duty, speed, memory["drawn"], heat)
        weak, less = self._warmth(heat)
        factor = weak * less
        torque = factor * duty * share[:, None] * self._stall
        rate = (1.0 - weak * factor) * speed
        if self.heat:  # weaker magnets give less torque at the current limit, too
            given = torque + self._slope * (rate - speed)
            most = weak * self._most_torque
            torque += np.clip(given, -most, most) - given
            torque = np.where(memory["off"], 0.0, torque)
            rate = np.where(memory["off"], speed, rate)
        return torque, rate, {**memory, "duty": duty, "share": share, "speed": speed}

    def at(self, memory: Memory) -> tuple[Array, ...]:
        """Return what `SupplyCourse` has of a memory, from the voltage on; (B, ...) each."""
        share, duty, speed, heat, off = (
            memory[name] for name in ("share", "duty", "speed", "heat", "off")
        )
        current = self._drawn(share, duty, speed, heat)[0].sum(axis=-1)
        battery, followed = self.battery, self._driven & self.heat
        return (
            share * (battery.voltage if battery else np.nan),
            current + (battery.standby_current if battery else np.nan),
            memory["drawn"] if battery else np.full(len(share), np.nan),
            np.where(self._known, self._current(share, duty, speed, heat, off), np.nan),
            np.where(followed, heat[..., 0], np.nan), np.where(followed, heat[..., 1], np.nan),
            off,
        )  # fmt: skip

    def _warmth(self, heat: Array) -> tuple[Array, Array]:
        """Return the torque constant and the conductance over those at 25 deg C (B, n) [-]."""
        if not self.heat:
            one = np.ones(heat.shape[:-1])
            return one, one
        warm = 1.0 + self._winding.copper * (heat[..., 0] - REFERENCE)
        return flux(self._winding, heat[..., 1]), 1.0 / warm

    def _free_current(self, share: Array, duty: Array, speed: Array, heat: Array) -> Array:
        """Return the motors' currents without their limits (B, n) [A]."""
        weak, less = self._warmth(heat)
        volts = duty * share[:, None] * self._stall - weak * self._slope * speed
        return np.asarray(less * volts / self._per_current)

    def _current(self, share: Array, duty: Array, speed: Array, heat: Array, off: Array) -> Array:
        """Return the motors' currents (B, n) [A]; 0 where the bridge is off."""
        free = self._free_current(share, duty, speed, heat)
        return np.where(off, 0.0, np.clip(free, -self._most, self._most))

    def _drawn(self, share: Array, duty: Array, speed: Array, heat: Array) -> tuple[Array, Array]:
        """Return what motors take from the bus (B, n) [A] and its slopes in the share [A]."""
        free = self._free_current(share, duty, speed, heat)
        weak, less = self._warmth(heat)
        taken = duty * free
        slope = duty**2 * less * self._stall / self._per_current
        over = (np.abs(free) > self._most) & (duty != 0.0)
        if over.any():
            held = np.clip(free, -self._most, self._most)
            volts = held * self._per_current / (less * np.maximum(self._stall, 1e-300))
            volts += weak * self._slope * speed / np.maximum(self._stall, 1e-300)  # over V
            power = np.where(over, held * volts, 0.0)
            taken = np.where(over, power / share[:, None], taken)
            slope = np.where(over, -power / share[:, None] ** 2, slope)
        if self.battery is None or not self.battery.regeneration:
            slope = np.where(taken > 0.0, slope, 0.0)
            taken = np.maximum(taken, 0.0)
        return taken, slope

    def _share(self, duty: Array, speed: Array, drawn: Array, heat: Array) -> Array:
        """Return the voltage under the sum of all currents over the full one (B,) [-]."""
        if self.battery is None:
            return np.ones(len(duty))
        full, ohm = self.battery.voltage, self.battery.resistance
        idle = (self.battery.open_voltage(drawn) - ohm * self.battery.standby_current) / full
        if ohm == 0.0:
            return np.asarray(idle)
        idle = np.maximum(idle, CLOSE)
        taken, _ = self._drawn(idle, duty, speed, heat)
        low, high = np.zeros_like(idle), idle + ohm / full * np.abs(taken).sum(axis=-1)
        share = idle.copy()
        for _ in range(ITERATIONS):
            taken, slope = self._drawn(share, duty, speed, heat)
            rest = idle - share - ohm / full * taken.sum(axis=-1)
            steep = -1.0 - ohm / full * slope.sum(axis=-1)
            low, high = np.where(rest >= 0.0, share, low), np.where(rest <= 0.0, share, high)
            with np.errstate(all="ignore"):
                ahead = share - rest / steep
            inside = (ahead > low) & (ahead < high) & (steep < 0.0)
            ahead = np.where(rest == 0.0, share, np.where(inside, ahead, 0.5 * (low + high)))
            done = np.abs(ahead - share) <= CLOSE
            share = ahead
            if done.all():
                break
        return share

    def _passed(self, speed: Array, memory: Memory, step: float) -> Memory:
        """Return the memory with the charge and the heat of the pass that ends now."""
        if step <= 0.0:
            return memory
        duty, share, heat, off = (memory[name] for name in ("duty", "share", "heat", "off"))
        ends = (memory["speed"], speed)
        found = dict(memory)
        if self.battery is not None:
            taken = [self._drawn(share, duty, v, heat)[0].sum(axis=-1) for v in ends]
            mean = 0.5 * (taken[0] + taken[1]) + self.battery.standby_current
            found["drawn"] = memory["drawn"] + step * mean
        if self.heat:
            first, last = (self._current(share, duty, v, heat, off) for v in ends)
            square = (first**2 + first * last + last**2) / 3.0  # mean, of a current linear in time
            # `warmed` counts the current of the cold motor at the same torque
            cold = square * flux(self._winding, heat[..., 1]) ** 2
            found["heat"] = warmed(self._winding, cold, heat, step, self._ambient)
            if self._limit is not None:
                found["off"] = off | (self._driven & (found["heat"][..., 1] > self._limit))
        return found


def _require(names: Sequence[str], rows: Array, driven: NDArray[np.bool_], needed: str) -> None:
    """Refuse a motor without constants.

    Raises:
        ParameterError: names the first joint whose motor lacks one.
    """
    lacking = driven & np.isnan(rows).any(axis=1)
    if lacking.any():
        name = names[int(np.argmax(lacking))]
        raise ParameterError(f"Scene.servo.motor[{name}]", None, f"given with {needed}")

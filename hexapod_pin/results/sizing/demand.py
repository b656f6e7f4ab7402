"""A joint demands torque, speed and power of any motor, over whole cycles of steady walking."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import joint_kinds as kinds_by_name
from hexapod_pin.results.sampled_summary import sampled_numbers, time_weights
from hexapod_pin.results.schema import Record, quantity, require_known, schema
from hexapod_pin.results.torque_budget import SAMPLES


class JointDemand(Record):
    """What n joints demand over a window that repeats; SI units. Of no motor in particular.

    Torques are those that the motor gives at the joint, the acceleration of the rotor that the
    run had (`armature`) included. Means are over time by the trapezoidal rule. Energies are per
    cycle, or of the window where nothing repeats. NaN is unknown.

    Attributes:
        joint_names: n names.
        joint_kinds: "coxa", "femur", "tibia", ... of each joint.
        cycles: whole gait cycles in the window; None where nothing repeats.
        peaks: what peaks, RMS and energies below are of: "accepted steps" or "samples". The
            larger of the accepted steps' peak and the samples' is taken.
        unheld: fraction of the window's stances that cannot hold at rest [-].
        unheld_lost_leg: the same by lost leg or foot, in the order of the feet.
        weight: mass times gravity [N].
        distance: along the heading per cycle [m]; None where none is known.
        geared: whether the torques contain what gears lose (`Motor.gear_friction`).
        robot_name: its name.
        notes: what to know of these numbers, one sentence each.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {"time": "time", "joint": "joint_names"}

    # fmt: off
    joint_names: tuple[str, ...]
    joint_kinds: tuple[str, ...]
    time: Array = quantity("time", "s", "time of the samples in the window")
    torque: Array = quantity("time joint", "N m", "samples of the torque")
    speed: Array = quantity("time joint", "rad/s", "samples of the joints' rates, signed")
    acceleration: Array = quantity("time joint", "rad/s^2", "differences of the speeds")
    cycles: int | None
    peaks: str
    torque_peak: Array = quantity("joint", "N m", "largest |torque|")
    torque_peak_time: Array = quantity("joint", "s", "time of torque_peak")
    torque_peak_speed: Array = quantity("joint", "rad/s",
        "rate at that time, > 0 where the joint drives")
    speed_peak: Array = quantity("joint", "rad/s", "largest |rate|")
    torque_p99: Array = quantity("joint", "N m", "|torque| not exceeded for 99 % of the time")
    torque_rms: Array = quantity("joint", "N m", "RMS torque")
    speed_rms: Array = quantity("joint", "rad/s", "RMS rate")
    acceleration_rms: Array = quantity("joint", "rad/s^2", "RMS acceleration")
    torque_acceleration: Array = quantity("joint", "N m rad/s^2",
        "mean of torque times acceleration")
    power_peak: Array = quantity("joint", "W", "largest |torque times rate|")
    positive_energy: Array = quantity("joint", "J", "work done by the joint")
    negative_energy: Array = quantity("joint", "J", "work absorbed by the joint, not positive")
    armature: Array = quantity("joint", "kg m^2",
        "rotor inertia at the joint that the torques contain")
    load_inertia: Array = quantity("joint", "kg m^2",
        "mean diagonal of the mass matrix, trunk fixed, rotor left out: of a leg in the air")
    standing: Array = quantity("joint", "N m", "|torque| at rest in the first posture, all feet")
    holding: Array = quantity("joint", "N m",
        "largest |torque| at rest in the postures and on the feet of the window")
    holding_lost_leg: Array = quantity("joint", "N m",
        "the same with one leg lost, of the stances that hold")
    # fmt: on
    unheld: float = float("nan")
    unheld_lost_leg: dict[str, float] = field(default_factory=dict)
    weight: float = float("nan")
    distance: float | None = None
    geared: bool = False
    robot_name: str = "robot"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check shapes and make read-only.

        Raises:
            ParameterError: an array of another shape, or fewer than two samples.
        """
        super().__post_init__()
        if len(self.time) < 2 or np.any(np.diff(self.time) <= 0.0):
            allowed = "two increasing times or more [s]"
            raise ParameterError("JointDemand.time", len(self.time), allowed)
        if len(self.joint_kinds) != len(self.joint_names):
            allowed = f"{len(self.joint_names)} names"
            raise ParameterError("JointDemand.joint_kinds", self.joint_kinds, allowed)

    @classmethod
    def of_samples(
        cls,
        time: ArrayLike,
        torque: ArrayLike,
        speed: ArrayLike,
        *,
        joint_names: Sequence[str] | None = None,
        joint_kinds: Sequence[str] | None = None,
        cycles: int | None = None,
        armature: ArrayLike = 0.0,
        load_inertia: ArrayLike = np.nan,
        standing: ArrayLike = np.nan,
        holding: ArrayLike = np.nan,
        holding_lost_leg: ArrayLike = np.nan,
        **whole: Any,
    ) -> JointDemand:
        """Return the demand of measured or made-up samples; all numbers are of the samples.

        Args:
            time: [s]. Shape (T,).
            torque: at the joints [N m]. Shape (T, n).
            speed: signed [rad/s]. Shape (T, n).
            joint_names: n names; None: "joint 1", ...
            joint_kinds: of the joints; None: from their names.
            cycles: how often the motion repeats within the samples; None: not at all.
            armature: rotor inertia that the torques contain [kg m^2]; one number or (n,).
            load_inertia: [kg m^2]; one number or (n,).
            standing: [N m]; one number or (n,).
            holding: [N m]; one number or (n,).
            holding_lost_leg: [N m]; one number or (n,).
            **whole: `weight`, `distance`, `robot`, `notes`.

        Raises:
            ParameterError: shapes that do not fit.
        """
        t, tau, rate = (np.array(x, dtype=float) for x in (time, torque, speed))
        if tau.ndim != 2 or tau.shape != rate.shape or t.shape != tau.shape[:1] or len(t) < 2:
            raise ParameterError("torque", tau.shape, f"(T, n) as speed {rate.shape}, T >= 2")
        n = tau.shape[1]
        names = tuple(joint_names or (f"joint {j + 1}" for j in range(n)))
        given: dict[str, Any] = {
            "armature": armature, "load_inertia": load_inertia, "standing": standing,
            "holding": holding, "holding_lost_leg": holding_lost_leg,
        }  # fmt: skip
        return cls(
            joint_names=names, joint_kinds=tuple(joint_kinds or kinds_by_name(names, n // 3)),
            time=t, torque=tau, speed=rate, acceleration=np.gradient(rate, t, axis=0),
            cycles=cycles, peaks=SAMPLES, **sampled_numbers(t, tau, rate, cycles or 1),
            **{k: _per_joint(k, v, n) for k, v in given.items()},
            **whole,
        )  # fmt: skip

    @cached_property
    def weights(self) -> Array:
        """Share of the time that each sample stands for (T,) [-]."""
        return read_only(time_weights(self.time))

    @property
    def duration(self) -> float:
        """Length of a cycle, or of the window where nothing repeats [s]."""
        return float(self.time[-1] - self.time[0]) / (self.cycles or 1)

    @property
    def cost_of_transport(self) -> float | None:
        """Mechanical work by its size / (m g d) [-], all joints; None without a distance."""
        return self.per_way(float(np.sum(self.positive_energy - self.negative_energy)))

    @property
    def cost_of_transport_positive(self) -> float | None:
        """The same where braking returns nothing and costs nothing [-]."""
        return self.per_way(float(np.sum(self.positive_energy)))

    def per_way(self, energy: float) -> float | None:
        """Return an energy per cycle [J] over weight and distance [-]; None without a distance."""
        if self.distance is None or not (self.distance > 0.0 and self.weight > 0.0):
            return None
        return energy / (self.weight * self.distance)

    @cached_property
    def _lagged(self) -> dict[float, Array]:
        return {}

    @cached_property
    def geared_torque(self) -> dict[str, Array]:
        """What motors give with the losses of their gears (T, n) [N m], by servo; filled by use."""
        return {}

    def thermal_rms(self, time_constant: float) -> Array:
        """Return the largest moving RMS torque, of samples (n,) [N m].

        The square root of the largest value of torque^2 behind a first-order lag. The window is
        taken to repeat for ever, so that a constant above its length needs no longer run; far
        above it, this is the RMS of the window.

        Args:
            time_constant: thermal, of what must not grow hot [s].

        Raises:
            ParameterError: it is not positive and finite.
        """
        if not (math.isfinite(time_constant) and time_constant > 0.0):
            raise ParameterError("time_constant", time_constant, "positive and finite [s]")
        if time_constant not in self._lagged:
            largest = largest_lagged(self.time, np.square(self.torque), time_constant)
            self._lagged[time_constant] = read_only(np.sqrt(largest))
        return self._lagged[time_constant]

    def torque_rms_with_armature(self, armature: ArrayLike) -> Array:
        """Return the RMS torque were the rotors' inertia another and the motion the same (n,).

        An estimate [N m]: a heavier rotor also takes the edge off every touch-down, so that the
        motion is not the same. What decides is a run with the motor itself.

        Args:
            armature: at the joint [kg m^2]. One number or (n,).

        Raises:
            ParameterError: it has another shape.
        """
        more = _per_joint("armature", armature, len(self.joint_names)) - self.armature
        square = (
            self.torque_rms**2
            + 2.0 * more * self.torque_acceleration
            + (more * self.acceleration_rms) ** 2
        )
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers but the samples as plain data; units are those of the attributes."""
        whole = ("joint_names", "joint_kinds", "cycles", "peaks", "unheld", "unheld_lost_leg",
                 "weight", "distance", "robot_name", "notes", "duration", "cost_of_transport",
                 "cost_of_transport_positive")  # fmt: skip
        plain = {name: getattr(self, name) for name in whole}
        return plain | {name: getattr(self, name).tolist() for name in per_joint()}

    def of_kinds(self, kinds: Sequence[str]) -> JointDemand:
        """Return the demand of the joints of some kinds alone.

        Raises:
            UnknownNameError: there is no such kind.
        """
        for kind in kinds:
            require_known("kind of joint", kind, sorted(set(self.joint_kinds)))
        if set(self.joint_kinds) <= set(kinds):
            return self
        chosen = [j for j, kind in enumerate(self.joint_kinds) if kind in kinds]
        samples = {k: getattr(self, k)[:, chosen] for k in ("torque", "speed", "acceleration")}
        return replace(
            self,
            joint_names=tuple(self.joint_names[j] for j in chosen),
            joint_kinds=tuple(self.joint_kinds[j] for j in chosen),
            **samples,
            **{name: getattr(self, name)[chosen] for name in per_joint()},
        )


def per_joint() -> list[str]:
    """Return the names of the numbers of each joint."""
    return [name for name, one in schema(JointDemand).items() if one.axes == ("joint",)]


def _per_joint(name: str, value: ArrayLike, count: int) -> Any:
    """Return a value of each joint.

    Raises:
        ParameterError: it is neither one number nor one of each joint.
    """
    found = np.asarray(value, dtype=float)
    if found.shape not in ((), (count,)):
        raise ParameterError(name, found.shape, f"one number, or one for each of {count} joints")
    return np.broadcast_to(found, count).copy()


def largest_lagged(time: Array, values: Array, constant: float) -> Array:
    """Return the largest value of a first-order lag, y' = (x - y) / constant, of each column.

    The samples are taken to repeat for ever: the lag starts where it ends. Between samples x is
    linear in time and the lag is exact.

    Args:
        time: [s]. Shape (T,).
        values: x. Shape (T, n).
        constant: [s], positive.

    Returns:
        Shape (n,); between the mean of x (constant far above the time) and its largest value.
    """
    step = np.diff(time)
    decay = np.exp(-step / constant)
    ramp = 1.0 + np.expm1(-step / constant) * constant / step  # share of a rise that has arrived
    rise = np.diff(values, axis=0)
    gain = (1.0 - decay)[:, None] * values[:-1] + ramp[:, None] * rise
    course = np.empty(values.shape)
    course[0] = 0.0
    for k in range(len(step)):
        course[k + 1] = decay[k] * course[k] + gain[k]
    start = course[-1] / -np.expm1((time[0] - time[-1]) / constant)
    left = np.exp((time[0] - time) / constant)[:, None]
    return np.asarray(np.max(course + left * start, axis=0))

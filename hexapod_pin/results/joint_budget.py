"""The rows of a torque budget: the window of whole cycles, one joint, one kind of joint."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace

Array = npt.NDArray[np.float64]

KINDS = ("coxa", "femur", "tibia")
AT_LIMIT = 0.999  # share of the effort limit from which a torque counts as limited

_PATTERNS = (  # one per kind; OpenSHC, PhantomX and `L1_1` names included
    re.compile(r"coxa|(^|_)c1(_|$)|_1$", re.IGNORECASE),
    re.compile(r"femur|thigh|_2$", re.IGNORECASE),
    re.compile(r"tibia|_3$", re.IGNORECASE),
)


@dataclass(frozen=True)
class Window:
    """The samples that a budget is taken over, both ends included."""

    first: int
    last: int
    start: float  # time of the first sample [s]
    end: float  # time of the last sample [s]
    cycles: int | None  # number of whole gait cycles; None where nothing repeats

    @property
    def parts(self) -> int:
        """What energies are divided by: the number of cycles, or 1."""
        return self.cycles or 1

    @property
    def samples(self) -> slice:
        """The window as a slice of the time axis."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class JointBudget:
    """What one joint delivers within the window; energies per cycle (or window)."""

    joint: str
    kind: str  # "coxa", "femur", "tibia", or "joint" where it cannot be told
    peak_torque: float  # largest |torque| [N m]
    peak_time: float  # time of that sample [s]
    effort_limit: float  # [N m]
    at_limit: float  # share of samples at the effort limit, 0 to 1
    p99_torque: float  # 99th percentile of |torque| [N m]
    rms_torque: float  # square root of the time average of torque^2 [N m]
    peak_speed: float  # largest |rate| [rad/s]
    rms_speed: float  # [rad/s]
    peak_power: float  # largest |torque * rate| [W]
    positive_energy: float  # work given by the joint [J], >= 0
    negative_energy: float  # work taken up by the joint [J], <= 0

    @property
    def absolute_energy(self) -> float:
        """Integral of |torque * rate| [J]."""
        return self.positive_energy - self.negative_energy


@dataclass(frozen=True)
class KindBudget:
    """The most that any joint of one kind delivers, and which joint that is; energies summed."""

    kind: str
    joints: tuple[str, ...]
    peak: JointBudget  # the joint with the largest peak torque
    p99: JointBudget  # ... with the largest 99th percentile
    rms: JointBudget  # ... with the largest RMS torque
    speed: JointBudget  # ... with the largest peak speed
    rms_speed: JointBudget  # ... with the largest RMS speed
    power: JointBudget  # ... with the largest peak power
    positive_energy: float  # of all joints of the kind, per cycle (or window) [J]
    negative_energy: float  # [J], <= 0

    @property
    def absolute_energy(self) -> float:
        """Integral of |torque * rate| of all joints of the kind [J]."""
        return self.positive_energy - self.negative_energy


def steady_window(trace: Trace) -> Window:
    """Return the whole cycles of steady walking; without cycles, the second half of the run.

    The ends are the samples nearest to `steady_from` and to a whole number of cycles later.

    Raises:
        ParameterError: the run is too short for one whole cycle; says how long it must be.
    """
    begin = float(trace.meta.get("steady_from") or 0.0)
    until = min(float(trace.meta.get("steady_until") or math.inf), float(trace.time[-1]))
    cycle = trace.meta.get("cycle_time")
    if cycle is None:
        begin, cycles, length = 0.5 * (begin + until), None, 0.5 * (until - begin)
    else:
        spacing = float(np.max(np.diff(trace.time), initial=0.0))
        cycles = math.floor((until - begin + min(0.5 * spacing, 0.1 * cycle)) / cycle)
        length = cycles * cycle
    first, last = _nearest(trace.time, begin), _nearest(trace.time, begin + length)
    if cycles == 0 or last <= first:
        raise _too_short(float(trace.time[-1]), begin, until, cycle)
    return Window(first, last, float(trace.time[first]), float(trace.time[last]), cycles)


def _nearest(time: Array, wanted: float) -> int:
    """Return the index of the sample nearest to a time."""
    return int(np.argmin(np.abs(time - wanted)))


def _too_short(duration: float, begin: float, until: float, cycle: float | None) -> ParameterError:
    """Say how long a simulation must be for a budget."""
    if cycle is None:
        return ParameterError("duration", duration, "long enough for two samples [s]")
    return ParameterError(
        "duration",
        duration,
        f"at least {begin + cycle:.4g} s of walking for one whole cycle",
        f"Steady walking lasts from {begin:.4g} to {until:.4g} s, a cycle {cycle:.4g} s: "
        f"simulate {begin + cycle:.4g} s or more (two cycles: {begin + 2 * cycle:.4g} s), "
        "and stop the gait no earlier.",
    )


def joint_rows(trace: Trace, window: Window) -> tuple[JointBudget, ...]:
    """Return one row per joint, in the trace's order."""
    kinds = joint_kinds(trace.joint_names, len(trace.foot_names))
    limits = trace.meta.get("effort_limit") or [math.inf] * len(kinds)
    return tuple(
        _joint_row(trace, window, k, kind, float(limits[k])) for k, kind in enumerate(kinds)
    )


def _joint_row(trace: Trace, window: Window, k: int, kind: str, limit: float) -> JointBudget:
    """Return the row of joint number k."""
    time = trace.time[window.samples]
    torque, rate = trace.torque[window.samples, k], trace.v[window.samples, 6 + k]
    power, size = torque * rate, np.abs(torque)
    return JointBudget(
        joint=trace.joint_names[k],
        kind=kind,
        peak_torque=float(np.max(size)),
        peak_time=float(time[np.argmax(size)]),
        effort_limit=limit,
        at_limit=float(np.mean(size >= AT_LIMIT * limit)),
        p99_torque=float(np.percentile(size, 99.0)),
        rms_torque=_rms(time, torque),
        peak_speed=float(np.max(np.abs(rate))),
        rms_speed=_rms(time, rate),
        peak_power=float(np.max(np.abs(power))),
        positive_energy=_integral(time, np.maximum(power, 0.0)) / window.parts,
        negative_energy=_integral(time, np.minimum(power, 0.0)) / window.parts,
    )


def _integral(time: Array, values: Array) -> float:
    """Integrate samples by the trapezoidal rule."""
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(time)))


def _rms(time: Array, values: Array) -> float:
    """Return the square root of the time average of the squares."""
    return math.sqrt(_integral(time, values**2) / float(time[-1] - time[0]))


def kind_rows(joints: Sequence[JointBudget]) -> tuple[KindBudget, ...]:
    """Return one row per kind of joint, in the order of first appearance along a leg."""
    kinds = [kind for kind in (*KINDS, "joint") if any(row.kind == kind for row in joints)]
    return tuple(_kind_row(kind, [row for row in joints if row.kind == kind]) for kind in kinds)


def _kind_row(kind: str, rows: Sequence[JointBudget]) -> KindBudget:
    """Return the row of one kind."""

    def worst(quantity: str) -> JointBudget:
        return max(rows, key=lambda row: getattr(row, quantity))

    worsts: dict[str, Any] = {
        "peak": worst("peak_torque"),
        "p99": worst("p99_torque"),
        "rms": worst("rms_torque"),
        "speed": worst("peak_speed"),
        "rms_speed": worst("rms_speed"),
        "power": worst("peak_power"),
    }
    return KindBudget(
        kind=kind,
        joints=tuple(row.joint for row in rows),
        positive_energy=sum(row.positive_energy for row in rows),
        negative_energy=sum(row.negative_energy for row in rows),
        **worsts,
    )


def joint_kinds(names: Sequence[str], feet: int) -> tuple[str, ...]:
    """Return the kind of every joint, by name, else by its place within its leg.

    The place counts where there are three joints per foot, listed leg by leg from the trunk
    outwards (*assumed* of robots whose names say nothing); otherwise all are "joint".
    """
    found = [_kind_of(name) for name in names]
    if all(found):
        return tuple(kind for kind in found if kind)
    if len(names) == 3 * feet:
        return KINDS * feet
    return ("joint",) * len(names)


def _kind_of(name: str) -> str | None:
    """Return the kind that a name tells, if it tells exactly one."""
    kinds = [kind for kind, pattern in zip(KINDS, _PATTERNS, strict=True) if pattern.search(name)]
    return kinds[0] if len(kinds) == 1 else None

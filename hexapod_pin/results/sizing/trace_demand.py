"""The joint demand is read from a trace.

It contains the torques that hold each posture of the walk, also with one leg lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.sampled_summary import sampled_numbers, summary_of
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.steady_window import Window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_budget import ACCEPTED_STEPS, SAMPLES, TorqueBudget, torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.holding_torque import holding_torque

MOST_POSTURES = 32
"""Postures of a window in which holding torque and inertia are looked at."""


@checked
def joint_demand(trace: Trace, *, postures: int = MOST_POSTURES) -> JointDemand:
    """Return what the joints of a walk demand of any motor; see `JointDemand`.

    Peaks, RMS and energies are those of the trace's summary; what needs the course over time is of
    samples.

    Args:
        trace: of a walk.
        postures: of the window, evenly spread, in which holding torque and inertia are looked at.

    Raises:
        NotRecordedError: the trace holds no torques.
        ParameterError: the run holds no whole cycle of steady walking, or fewer than 2 postures.
    """
    if postures < 2:
        raise ParameterError("postures", postures, "at least 2")
    whole = torque_budget(trace)
    window, inside = whole.window, whole.window.samples
    time, torque, speed = trace.time[inside], trace.torque[inside], trace.v[inside, 6:]
    numbers: dict[str, Any] = sampled_numbers(time, torque, speed, window.parts)
    notes = [SOURCES[whole.peaks]]
    numbers |= _accepted(summary_of(trace), trace, numbers)
    numbers |= _of_robot(trace, window, postures, notes)
    notes += _limited(whole)
    makes_way = whole.makes_way and whole.distance is not None
    return JointDemand(
        joint_names=trace.joint_names,
        joint_kinds=joint_kinds(
            trace.joint_names, len(trace.foot_names), trace.run.robot.joint_kinds
        ),
        time=time, torque=torque, speed=speed,
        acceleration=np.gradient(trace.v[:, 6:], trace.time, axis=0)[inside],
        cycles=window.cycles, peaks=whole.peaks,
        weight=whole.weight, distance=whole.distance if makes_way else None,
        robot_name=whole.robot_name, geared=_geared(trace),
        notes=tuple(notes), **numbers,
    )  # fmt: skip


def _geared(trace: Trace) -> bool:
    """Return whether motors of the run had gear friction, which their torques then contain."""
    scene = trace.run.scene
    motor = None if scene is None or scene.servo is None else scene.servo.motor
    motors = motor.values() if isinstance(motor, Mapping) else [motor]
    return any(one is not None and one.gear_friction is not None for one in motors)


def _accepted(summary: Summary, trace: Trace, sampled: dict[str, Any]) -> dict[str, Any]:
    """Return the numbers of accepted steps; those of samples where they are not known."""
    found = {
        "torque_p99": summary.torque_p99,
        "torque_rms": summary.torque_rms,
        "speed_rms": summary.speed_rms,
        "acceleration_rms": summary.acceleration_rms,
        "torque_acceleration": summary.torque_acceleration,
        "power_peak": np.fmax(np.abs(summary.power_peak), sampled["power_peak"]),
        "speed_peak": np.fmax(np.abs(summary.speed_peak), sampled["speed_peak"]),
        "positive_energy": summary.positive_energy,
        "negative_energy": summary.negative_energy,
    }
    found = {k: np.where(np.isfinite(v), v, sampled[k]) for k, v in found.items()}
    larger = np.abs(summary.torque_peak) > sampled["torque_peak"]
    times, peaks = summary.torque_peak_time, summary.torque_peak
    rates = [np.interp(t, trace.time, trace.v[:, 6 + j]) for j, t in enumerate(times)]
    accepted = {
        "torque_peak": np.abs(peaks),
        "torque_peak_time": times,
        "torque_peak_speed": np.array(rates) * np.sign(peaks),
    }
    return found | {k: np.where(larger, v, sampled[k]) for k, v in accepted.items()}


def _of_robot(trace: Trace, window: Window, postures: int, notes: list[str]) -> dict[str, Any]:
    """Return what needs the robot's model; NaN with a note where the trace does not contain it."""
    unknown = np.full(len(trace.joint_names), np.nan)
    nothing = {"armature": np.zeros(len(unknown))} | dict.fromkeys(
        ("load_inertia", "standing", "holding", "holding_lost_leg"), unknown
    )
    try:
        robot = RecordedRobot.of(trace)
    except ParameterError as error:
        notes.append(
            f"holding torque and load inertia are unknown, armature is taken as 0: {error}"
        )
        return nothing
    first, stop = window.samples.start, window.samples.stop
    picked = np.unique(np.linspace(first, stop - 1, postures).round().astype(int))
    known = {"armature": robot.armature, "load_inertia": load_inertia(robot, trace.q[picked])}
    if "contacts" not in trace.recorded or not robot.gravity.any():
        notes.append("holding torque is unknown: the trace holds no contacts, or no weight")
        return nothing | known
    held = holding_demand(robot, trace, picked)
    notes.extend(held.notes)
    return known | held.numbers


def load_inertia(robot: RecordedRobot, q: Array) -> Array:
    """Return the mean diagonal of the mass matrix, joints only, without rotors (n,) [kg m^2].

    The moment of inertia about its axis of everything a joint carries outwards.

    Args:
        robot: with its payloads.
        q: postures. Shape (K, nq).
    """
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    found = np.zeros(model.nv)
    for posture in q:
        found += np.diag(pin.crba(model, data, posture)) - model.armature
    return np.asarray(found[6:] / len(q))


def _limited(budget: TorqueBudget) -> list[str]:
    """Return a note where the run's own limits cut torques off."""
    cut = {row.joint: row.at_limit for row in budget.joints if row.at_limit > 0.0}
    if not cut:
        return []
    most = max(cut, key=lambda joint: cut[joint])
    return [
        f"{len(cut)} joints were at the torque limit of the run, {most} for "
        f"{100.0 * cut[most]:.2g} % of the time: what a stronger motor would deliver is unknown"
    ]


SOURCES = {
    SAMPLES: "all numbers are of samples: what lies between two is missed",
    ACCEPTED_STEPS: (
        "peaks, p99, RMS, accelerations and mechanical energies are of accepted steps; share "
        "outside the line, moving RMS and battery are of samples; peak use is the larger of the "
        "samples' and that of the accepted steps' peak at the speed sampled at its time"
    ),
}
"""What the numbers of a demand are taken from."""


# Holding torque in the postures and on the feet that a walk visits, and with one leg lost.


@dataclass(frozen=True, eq=False)
class HoldingDemand:
    """Static, quasi-static at every posture: no acceleration, feet push along gravity.

    Attributes:
        standing: |torque| in the first posture on all feet (n,) [N m].
        holding: largest |torque| in the stances that hold, (n,) [N m].
        holding_lost_leg: the same, any one leg lost; the lost leg's own joints left out (n,) [N m].
        unheld: share of the walk's stances that tip over at rest [-].
        unheld_lost_leg: the same with that leg (or foot) lost, by its name.
    """

    standing: Array
    holding: Array
    holding_lost_leg: Array
    unheld: float
    unheld_lost_leg: dict[str, float]

    @property
    def numbers(self) -> dict[str, Any]:
        """What `JointDemand` takes over."""
        return dict(vars(self))

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of it."""
        notes = [
            "holding torque is that of static equilibrium in the walk's postures on the feet that "
            "stand, and of the first posture on all feet; feet push along gravity, shares of least "
            "norm where they are open"
        ]
        if self.unheld > 0.0:
            notes.append(f"{100.0 * self.unheld:.0f} % of the stances of the walk cannot hold at "
                         "rest: the robot would tip over")  # fmt: skip
        fallen = {name: share for name, share in self.unheld_lost_leg.items() if share > 0.0}
        if fallen:
            shares = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in fallen.items())
            notes.append(f"stances of the walk that cannot hold without one leg: {shares}")
        return tuple(notes)


def holding_demand(robot: RecordedRobot, trace: Trace, samples: NDArray[np.intp]) -> HoldingDemand:
    """Return the holding torques of a trace at some of its samples.

    The trace's first posture, on all feet, is looked at besides them: a robot at rest.
    """
    feet = robot.robot.feet
    count = len(feet)
    stands = np.vstack([np.ones((1, count), bool), trace.contact[samples][:, :count]])
    q = np.vstack([trace.q[:1], trace.q[samples]])
    lost = ~np.eye(count, dtype=bool)
    supports = np.concatenate([stands[:, None], stands[:, None] & lost], axis=1)
    found = holding_torque(robot.model, foot_places(robot), q, supports)
    size = np.abs(found.torque)
    for foot in range(count):
        size[:, 1 + foot, list(robot.joints_above(foot))] = np.nan
    falls = 1.0 - found.holds[1:].mean(axis=0)
    names = [getattr(foot, "leg", None) or foot.name for foot in feet]
    return HoldingDemand(
        size[0, 0],
        _largest(size[:, :1]),
        _largest(size[:, 1:]),
        float(falls[0]),
        {names[k]: float(falls[1 + k]) for k in range(count)},
    )


def foot_places(robot: RecordedRobot) -> list[tuple[int, Array]]:
    """Return the joint that moves each foot, and the foot in that joint's frame [m]."""
    feet = robot.robot.feet
    return [(robot.contact_joints[k], np.asarray(foot.offset)) for k, foot in enumerate(feet)]


def _largest(size: Array) -> Array:
    """Return the largest of each joint over postures and supports; NaN where none holds."""
    flat = size.reshape(-1, size.shape[-1])
    known = np.isfinite(flat)
    return np.where(known.any(axis=0), np.where(known, flat, -np.inf).max(axis=0), np.nan)

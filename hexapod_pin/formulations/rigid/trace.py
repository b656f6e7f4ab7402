"""Samples of a walk on rigid ground (S2 eqs. 1-5) as a `Trace`, and the friction it needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.energy import energy
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.state import State

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper, Snapshot
    from hexapod_pin.formulations.rigid.model import RigidModel

METHOD = "rigid contact: S2 eqs. 1-5, extrapolated linearly implicit Euler, order 2"
ENERGIES = ("kinetic", "potential", "servo_work", "joint_damping_loss", "normal_loss")


@dataclass(frozen=True)
class FrictionDemand:
    """Friction that sticking needed of one foot over a walk.

    Attributes:
        foot: its name.
        down: share of the samples on the ground [-].
        sliding: share of those with a force outside the cone [-]: a real foot would have slid.
        median_ratio: half of the samples on the ground need less friction than this [-].
    """

    foot: str
    down: float
    sliding: float
    median_ratio: float


def friction_demand(trace: Trace, model: RigidModel) -> tuple[FrictionDemand, ...]:
    """Return one row per foot."""
    found = []
    for k, name in enumerate(trace.foot_names):
        held = trace.contact[:, k]
        normal = trace.normal_force[held, k]
        ratio = np.linalg.norm(trace.tangential_force[held, k], axis=1) / normal
        sliding = float((ratio > model.ground.mu).mean()) if len(ratio) else 0.0
        median = float(np.median(ratio)) if len(ratio) else 0.0
        found.append(FrictionDemand(name, float(held.mean()), sliding, median))
    return tuple(found)


class RigidRecorder:
    """Collects the samples of a walk."""

    def __init__(self, stepper: ConstrainedStepper) -> None:
        """Begin without samples."""
        self._stepper = stepper
        self._rows: list[dict[str, float | Array]] = []

    def add(self, now: Snapshot, work: Mapping[str, float]) -> None:
        """Add a sample; `work` is what was done and lost since the start [J]."""
        model = self._stepper.model
        wanted, rate, _ = self._stepper.set_points(now.time)
        conserved = energy(model, State(now.q, now.v))
        radius = np.array([[foot.radius] for foot in model.robot.feet])
        self._rows.append({
            "time": now.time, "q": now.q, "v": now.v, "torque": now.solution.torque,
            "q_ref": wanted, "v_ref": rate, "com": conserved.center_of_mass,
            "foot_position": now.terms.place + radius * model.normal,
            "foot_force": now.solution.force, "foot_gap": now.terms.gap,
            "kinetic": conserved.kinetic, "potential": conserved.potential, **work,
        })  # fmt: skip

    def trace(
        self, controller: Controller, counters: Mapping[str, int], step: float, sample: float
    ) -> Trace:
        """Return the samples as a trace of a controller's run; step and sample in [s]."""
        import tomli_w

        model = self._stepper.model
        columns = {
            name: np.array([row[name] for row in self._rows], dtype=float) for name in self._rows[0]
        }
        none = np.zeros(len(self._rows))
        energies = {name: columns.pop(name) for name in ENERGIES}
        settings = {"step": step, "sample": sample, "method": METHOD}
        return Trace(
            **columns,
            energy={**energies, "elastic": none, "friction_loss": none},
            counters=dict(counters),
            joint_names=model.robot.joint_names,
            foot_names=model.foot_names,
            meta={"controller": tomli_w.dumps(controller.to_dict()), **settings, **self._meta()},
            foot_normal=model.normal,
            error=None,
        )

    def _meta(self) -> dict[str, object]:
        model, plan, servo = self._stepper.model, self._stepper.set_points.plan, self._stepper.servo
        robot = model.robot
        return {
            "cycle_time": plan.cycle_time, "steady_from": plan.steady_from,
            "steady_until": plan.steady_until,
            "travel_direction": [float(x) for x in plan.travel_direction],
            "nominal_speed": float(plan.speed), "robot_name": robot.name, "urdf": robot.urdf,
            "foot_radius": [float(foot.radius) for foot in robot.feet],
            "total_mass": robot.total_mass, "gravity": model.gravity.tolist(),
            "effort_limit": robot.effort.tolist(), "velocity_limit": robot.velocity.tolist(),
            "assumed": [
                *robot.assumed,
                f"servo gains: {servo.describe()}",
                f"rigid ground on which feet stick; checked against mu {model.ground.mu:g}",
            ],
            "provenance": robot.provenance, "model_digest": robot.digest,
        }  # fmt: skip

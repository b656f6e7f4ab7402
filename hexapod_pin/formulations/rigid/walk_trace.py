"""Samples of a rigid walk as a `Trace`, and what sticking asked of its feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.trace import Trace

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.formulations.rigid.constrained_step import Drive, Moment
    from hexapod_pin.formulations.rigid.model import RigidModel


@dataclass(frozen=True)
class FootUse:
    """What sticking asked of one foot over a walk.

    Attributes:
        foot: its name.
        down: share of the samples on the ground.
        sliding: share of those with a force outside the cone: there a real foot would have slid.
        median_ratio: half of the samples on the ground need less friction than this [-].
    """

    foot: str
    down: float
    sliding: float
    median_ratio: float


def foot_use(trace: Trace, model: RigidModel) -> tuple[FootUse, ...]:
    """Return one row per foot."""
    rows = []
    for k, name in enumerate(trace.foot_names):
        held = trace.contact[:, k]
        push = trace.normal_force[held, k]
        need = np.linalg.norm(trace.tangential_force[held, k], axis=1) / push
        sliding = float((need > model.ground.mu).mean()) if len(need) else 0.0
        median = float(np.median(need)) if len(need) else 0.0
        rows.append(FootUse(name, float(held.mean()), sliding, median))
    return tuple(rows)


class Recorder:
    """Collects samples."""

    def __init__(
        self, drive: Drive, controller: Controller, duration: float, step: float, sample: float
    ) -> None:
        """Remember what the run is."""
        self.drive, self.controller = drive, controller
        self.settings = {"duration": duration, "step": step, "sample": sample}
        self.rows: list[dict[str, Any]] = []

    def take(self, moment: Moment, energy: Mapping[str, float]) -> None:
        """Add a sample."""
        import pinocchio as pin

        model = self.drive.model
        wanted, rate, _ = self.drive.points(moment.time)
        com = np.array(pin.centerOfMass(model.model, model.data, moment.q))
        radius = np.array([[foot.radius] for foot in model.robot.feet])
        self.rows.append({
            "time": moment.time, "q": moment.q, "v": moment.v, "torque": moment.motion.torque,
            "q_ref": wanted, "v_ref": rate, "com": com,
            "foot_position": moment.terms.place + radius * model.normal,
            "foot_force": moment.motion.force, "foot_gap": moment.terms.gap,
            "kinetic": model.kinetic_energy(moment.q, moment.v),
            "potential": -model.robot.total_mass * float(model.gravity @ com),
            **energy,
        })  # fmt: skip

    def trace(self, counters: Mapping[str, int]) -> Trace:
        """Return the samples as a trace."""
        model = self.drive.model
        names = ("time", "q", "v", "torque", "q_ref", "v_ref", "com", "foot_position", "foot_force")
        arrays = {name: self._column(name) for name in (*names, "foot_gap")}
        nothing = np.zeros(len(self.rows))
        kept = ("kinetic", "potential", "servo_work", "joint_damping_loss", "normal_loss")
        energy = {name: self._column(name) for name in kept}
        return Trace(
            **arrays,
            energy={**energy, "elastic": nothing, "friction_loss": nothing},
            counters=dict(counters),
            joint_names=model.robot.joint_names,
            foot_names=model.foot_names,
            meta=self._meta(),
            foot_normal=model.normal,
        )

    def _column(self, name: str) -> Array:
        return np.array([row[name] for row in self.rows], dtype=float)

    def _meta(self) -> dict[str, Any]:
        import tomli_w

        model, plan = self.drive.model, self.drive.points.plan
        robot, ground = model.robot, model.ground
        gains = f"kp {self.drive.servo.kp:g} N m/rad, kd {self.drive.servo.kd:g} N m s/rad"
        return {
            "controller": tomli_w.dumps(self.controller.to_dict()),
            "method": "rigid contact: S2 eqs. 1-5, extrapolated linearly implicit Euler, order 2",
            "step": self.settings["step"], "sample": self.settings["sample"],
            "cycle_time": plan.cycle_time, "steady_from": plan.steady_from,
            "steady_until": plan.steady_until,
            "travel_direction": [float(x) for x in plan.travel_direction],
            "nominal_speed": float(plan.speed), "robot_name": robot.name, "urdf": robot.urdf,
            "foot_radius": [float(foot.radius) for foot in robot.feet],
            "total_mass": robot.total_mass, "gravity": model.gravity.tolist(),
            "effort_limit": robot.effort.tolist(), "velocity_limit": robot.velocity.tolist(),
            "assumed": [*robot.assumed, f"servo gains: {gains}",
                        f"rigid ground on which feet stick; checked against mu {ground.mu:g}"],
            "provenance": robot.provenance, "model_digest": robot.digest,
        }  # fmt: skip

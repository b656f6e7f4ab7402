"""The maximal formulation must agree with the core on the same scene, built twice."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.drive.servo import check_plain_drives
from hexapod_pin.formulations.maximal import (
    Baumgarte,
    GroundContact,
    JointActuators,
    MaximalModel,
    derivative,
    initial_state,
    read_bodies,
    reduced_acceleration,
)
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.hard_case import Check

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array

    Sample = tuple[Array, Array, Array]
    """q (7 + n,), v (6 + n,) and servo torques (n,) in the robot's order."""


# Core against maximal coordinates: accelerations at random states.


@dataclass(frozen=True, eq=False)
class Twin:
    """A scene in maximal coordinates.

    Attributes:
        model: the bodies on their ground.
        order: (n,) joint j of the model is joint order[j] of the robot.
    """

    model: MaximalModel
    order: NDArray[np.intp]

    def bodies_order(self, values: Array, head: int) -> Array:
        """Return robot-ordered numbers in the model's order, after `head` of the base."""
        return np.concatenate([values[:head], values[head:][self.order]])

    def robot_order(self, values: Array, head: int) -> Array:
        """Return model-ordered numbers (..., head + n) in the robot's order."""
        found = np.array(values)
        found[..., head + self.order] = values[..., head:]
        return found

    def acceleration(self, sample: Sample) -> Array:
        """Return v' (6 + n,) at a sample, contacts never seen before."""
        q, v, torque = sample
        state = initial_state(self.model, self.bodies_order(q, 7), self.bodies_order(v, 6))
        rates = derivative(self.model, state, torque[self.order]).acceleration
        return self.robot_order(reduced_acceleration(self.model.bodies, state, rates), 6)


def maximal_twin(scene: Scene, *, baumgarte: Baumgarte | None = None) -> Twin:
    """Return the scene's robot from its URDF text, with the scene's laws, servos and stops.

    Raises:
        UrdfError: not a tree of turning joints with mass everywhere.
        ParameterError: laws that maximal coordinates cannot do on this ground, motors, dry
            friction or loads.
    """
    scene.require_unloaded("in maximal coordinates")
    robot, servo, stops = scene.robot, scene.servos, scene.joint_stops
    check_plain_drives(robot, servo, "maximal coordinates")
    kp, kd = servo.gains(robot)
    names, radii = zip(*((foot.name, foot.radius) for foot in robot.feet), strict=True)
    bodies = read_bodies(robot.urdf, names, radii)
    order = [robot.joint_index(name) for name in bodies.joint_names]
    actuators = JointActuators.uniform(
        bodies, kp=kp[order], kd=kd[order], limited=servo.limited,
        stop_stiffness=stops.stiffness, stop_dissipation=stops.dissipation,
    )  # fmt: skip
    contact = GroundContact(bodies, scene.contact, scene.terrain)
    model = MaximalModel(
        bodies, actuators=actuators, contact=contact, gravity=scene.gravity, baumgarte=baumgarte
    )
    return Twin(model, np.array(order, dtype=np.intp))


def pressed_states(scene: Scene, count: int, *, seed: int = 7) -> list[Sample]:
    """Return random states near standing, five feet of six at least 0.1 mm in level ground."""
    rng, twin = np.random.default_rng(seed), maximal_twin(scene)
    found, n = [], len(scene.robot.joint_names)
    for _ in range(count):
        turn = np.append(0.05 * rng.normal(size=3), 1.0)
        angles = scene.robot.posture + 0.1 * rng.normal(size=n)
        q = np.concatenate([[*rng.normal(size=2), 0.0], turn / np.linalg.norm(turn), angles])
        v, torque = rng.normal(size=6 + n), rng.normal(size=n)
        state = initial_state(twin.model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
        q[2] -= np.sort(twin.model.gaps(0.0, state))[len(scene.robot.feet) - 2] + 1e-4
        found.append((q, v, torque))
    return found


def compare_accelerations(scene: Scene, states: Iterable[Sample]) -> float:
    """Return the largest difference of v' between core and maximal, over the largest v'."""
    from hexapod_pin import native
    from hexapod_pin.simulation.plant import native_plant

    twin, plant, worst = maximal_twin(scene), native_plant(scene), 0.0
    for q, v, torque in states:
        known = native.evaluate(plant, q, v, torque)["acceleration"]
        off = np.abs(twin.acceleration((q, v, torque)) - known).max() / np.abs(known).max()
        worst = max(worst, float(off))
    return worst


def position_difference(q: Array, other: Array) -> float:
    """Return the largest difference between samples (T, 7 + n): base [m], turn, joints [rad]."""
    sign = np.sign(np.sum(q[:, 3:7] * other[:, 3:7], axis=1))[:, None]
    turn = 2.0 * np.linalg.norm(q[:, 3:7] - sign * other[:, 3:7], axis=1)
    apart = np.abs(np.delete(q - other, np.s_[3:7], axis=1))
    return float(max(apart.max(), turn.max()))


# S1's maximal coordinates against the core: accelerations with contacts.

FEW_STATES = 40


def accelerations() -> float:
    """Return the largest relative difference of accelerations at random states with contacts."""
    scene = Scene(load_robot("kharagpur"))
    return compare_accelerations(scene, pressed_states(scene, FEW_STATES))


CHECKS = (
    Check("maximal-motion", "accelerations on feet: core against maximal coordinates, 40 states",
          accelerations, 1e-9, source="S1 eqs. 1-3"),
)  # fmt: skip

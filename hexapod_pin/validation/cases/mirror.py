"""HC37: the same scene shifted, turned, mirrored, re-ordered; run in parts; run beside others."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.batch import simulate_batch
from hexapod_pin.simulation.case import Case
from hexapod_pin.validation.case_result import ExpectedValue
from hexapod_pin.validation.cases.drop import drop
from hexapod_pin.validation.cases.robots import robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.solver_setting import (
    DOP853,
    IMPLICIT_1MS,
    NDF,
    ROBUST_1MS,
    CaseRun,
    SolverSetting,
    rk4,
)

Values = Iterator[ExpectedValue]

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
Index = NDArray[np.intp]


@dataclass(frozen=True)
class SampledMotion:
    """Samples of a run: configurations (T, nq) and velocities (T, nv)."""

    q: Array
    v: Array

    @classmethod
    def of(cls, trace: Trace) -> SampledMotion:
        """Return a trace's motion."""
        return cls(trace.q.copy(), trace.v.copy())

    def apart(self, other: SampledMotion) -> float:
        """Return the largest difference of any number; q and -q are one attitude."""
        sign = np.sign(np.einsum("ti,ti->t", self.q[:, 3:7], other.q[:, 3:7]))[:, np.newaxis]
        q = np.concatenate([other.q[:, :3], sign * other.q[:, 3:7], other.q[:, 7:]], axis=1)
        return float(max(np.abs(self.q - q).max(), np.abs(self.v - other.v).max()))


def base_run() -> CaseRun:
    """Return HC40 mid with unequal joint angles and rates, 0.1 s, sampled every 10 ms."""
    run = drop("mid", duration=0.1, sample=0.01)
    robot = run.scene.robot
    generator = np.random.default_rng(4)
    q, v = run.start.q.copy(), run.start.v.copy()
    q[7:] += generator.uniform(-0.1, 0.1, 18)
    v[6:] += generator.uniform(-1.0, 1.0, 18)
    posture = q[7:] + generator.uniform(-0.1, 0.1, 18)
    held = SampledTrajectory([0.0], [posture], limited=False)
    return CaseRun(run.scene, robot.check_state(q, v), run.duration, run.sample, held)


def moved(run: CaseRun, q: Array, v: Array, *, scene: Scene | None = None,
          posture: Array | None = None) -> CaseRun:  # fmt: skip
    """Return a run from another state, and with another scene or posture held if given."""
    where = scene or run.scene
    controller = (
        run.controller if posture is None else SampledTrajectory([0.0], [posture], limited=False)
    )
    start = where.robot.check_state(q, v)
    return CaseRun(where, start, run.duration, run.sample, controller)


# --- shifted and turned -------------------------------------------------------------------------

SHIFT = np.array([64.0, -16.0, 0.0])
"""[m]"""


def shifted(run: CaseRun, setting: SolverSetting) -> SampledMotion:
    """Run it some setting off and bring it back."""
    q = run.start.q.copy()
    q[:3] += SHIFT
    found = SampledMotion.of(moved(run, q, run.start.v).by(setting))
    found.q[:, :3] -= SHIFT
    return found


def yawed(run: CaseRun, angle: float, setting: SolverSetting) -> SampledMotion:
    """Run it turned about the vertical and turn it back."""
    found = SampledMotion.of(moved(run, _turned(run.start.q, angle), run.start.v).by(setting))
    return SampledMotion(np.array([_turned(q, -angle) for q in found.q]), found.v)


def _turned(q: Array, angle: float) -> Array:
    import pinocchio as pin

    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, angle))
    out: Array = q.copy()
    out[:3] = turn.matrix() @ q[:3]
    out[3:7] = (turn * pin.Quaternion(q[3:7])).coeffs()
    return out


# --- mirrored -----------------------------------------------------------------------------------


def mirrored(run: CaseRun, setting: SolverSetting) -> SampledMotion:
    """Run its mirror image, left for right, and mirror it back."""
    robot = run.scene.robot
    joints, signs = mirror_map(robot)
    posture = signs * run.controller.plan(robot, 1.0).q[0][joints]
    start = _mirror(run.start.q, run.start.v, joints, signs)
    found = SampledMotion.of(moved(run, *start, posture=posture).by(setting))
    pairs = [_mirror(q, v, joints, signs) for q, v in zip(found.q, found.v, strict=True)]
    return SampledMotion(np.array([q for q, _ in pairs]), np.array([v for _, v in pairs]))


def _mirror(q: Array, v: Array, joints: Index, signs: Array) -> tuple[Array, Array]:
    """Mirror a state in the x-z plane."""
    place = q[:3] * [1.0, -1.0, 1.0]
    attitude = q[3:7] * [-1.0, 1.0, -1.0, 1.0]
    twist = v[:6] * [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
    return (
        np.concatenate([place, attitude, signs * q[7:][joints]]),
        np.concatenate([twist, signs * v[6:][joints]]),
    )


def mirror_map(robot: Robot) -> tuple[Index, Array]:
    """Return, for every joint, its partner across the x-z plane and the sign of its angle.

    The signs are those that mirror the foot for some angles at random; the map is its own inverse.
    """
    joints = np.zeros(len(robot.joint_names), dtype=np.intp)
    signs = np.zeros(len(robot.joint_names))
    generator = np.random.default_rng(0)
    angles = generator.uniform(-0.5, 0.5, (4, 3))
    for leg in robot.legs:
        partner = robot.leg({"l": "r", "r": "l"}[leg.name[0]] + leg.name[1])
        here, there = (LegKinematics.of(robot, one.name) for one in (leg, partner))
        flip = np.array([1.0, -1.0, 1.0])
        [sign] = [
            s for s in product((1.0, -1.0), repeat=3)
            if all(
                np.allclose(here.forward(np.array(s) * q), flip * there.forward(q), atol=1e-12)
                for q in angles
            )
        ]  # fmt: skip
        for own, other, s in zip(leg.joints, partner.joints, sign, strict=True):
            joints[robot.joint_index(own)] = robot.joint_index(other)
            signs[robot.joint_index(own)] = s
    return joints, signs


# --- legs in another order ----------------------------------------------------------------------


def reordered_robot() -> Robot:
    """Return the reference hexapod with the legs the other setting round in its tree.

    Pinocchio takes the joints of a link in the order of their names: every leg of L1 .. R3 is
    renamed for that, and named back by the caller's map.
    """
    order = ["L1", "L2", "L3", "R1", "R2", "R3"]
    names = dict(zip(order, ["R3", "R2", "R1", "L3", "L2", "L1"], strict=True))
    text = re.sub(
        r"\b(L[123]|R[123])(?=_)", lambda found: names[found[1]],
        robot_file("hexa_ref").read_text(encoding="utf-8"),
    )  # fmt: skip
    with TemporaryDirectory() as folder:
        path = Path(folder) / "reordered.urdf"
        path.write_text(text, encoding="utf-8")
        return load_robot(path, feet=[f"{name}_foot" for name in order], forward="x")


def reordered(run: CaseRun, setting: SolverSetting) -> SampledMotion:
    """Run the robot whose legs stand in the other order; its joints in the order of the first."""
    robot = reordered_robot()
    names = dict(zip(["L1", "L2", "L3", "R1", "R2", "R3"],
                     ["R3", "R2", "R1", "L3", "L2", "L1"], strict=True))  # fmt: skip
    index = np.array(
        [robot.joint_index(names[own[:2]] + own[2:]) for own in run.scene.robot.joint_names]
    )
    back = np.argsort(index)
    first = run.scene
    scene = Scene(
        robot, contact=first.contact, servo=first.servo, stops=first.stops, gravity=first.gravity
    )
    q = np.concatenate([run.start.q[:7], run.start.q[7:][back]])
    v = np.concatenate([run.start.v[:6], run.start.v[6:][back]])
    posture = run.controller.plan(first.robot, 1.0).q[0][back]
    found = SampledMotion.of(moved(run, q, v, scene=scene, posture=posture).by(setting))
    return SampledMotion(
        np.concatenate([found.q[:, :7], found.q[:, 7:][:, index]], axis=1),
        np.concatenate([found.v[:, :6], found.v[:, 6:][:, index]], axis=1),
    )


# --- in parts, and beside others ----------------------------------------------------------------


def restarted(run: CaseRun, setting: SolverSetting, parts: int = 2) -> SampledMotion:
    """Run it in equal parts, each from the checkpoint of the one before, read from its text."""
    q, v = [], []
    start: State | Checkpoint = run.start
    for part in range(parts):
        trace = CaseRun(run.scene, start, run.duration / parts, run.sample, run.controller).by(
            setting
        )
        start = Checkpoint.from_dict(json.loads(json.dumps(trace.checkpoint.to_dict())))
        q.append(trace.q[min(part, 1) :])
        v.append(trace.v[min(part, 1) :])
    return SampledMotion(np.concatenate(q), np.concatenate(v))


def in_a_batch(run: CaseRun, setting: SolverSetting) -> SampledMotion:
    """Run it as the second of four cases on two threads."""
    other = base_run()
    cases = [Case(one.scene, one.controller, one.start) for one in (other, run, other, other)]
    traces = simulate_batch(
        cases, duration=run.duration, sample=run.sample, threads=2, errors="raise",
        **setting.arguments,
    )  # fmt: skip
    return SampledMotion.of(traces[1])  # type: ignore[arg-type]  # errors are raised


# --- rows ---------------------------------------------------------------------------------------


def transformed(setting: SolverSetting) -> Values:
    """Every transformation, undone, against the run as it is."""
    run = base_run()
    known = SampledMotion.of(run.by(setting))
    # 64 m away a place is rounded to 7e-15 m at every step
    yield ExpectedValue("shifted by 64 m", known.apart(shifted(run, setting)), 1e-12, "any")
    # sums over legs in another order: round-off, grown by the contacts
    yield ExpectedValue("legs in another order", known.apart(reordered(run, setting)), 1e-9, "any")
    # the largest component of an error is not the same in turned axes: adaptive steps differ
    if not setting.adaptive:
        yield ExpectedValue("turned by 2 rad", known.apart(yawed(run, 2.0, setting)), 1e-9, "any")
    yield ExpectedValue("mirrored", known.apart(mirrored(run, setting)), 1e-9, "any")
    # a checkpoint holds all that the future depends on: the same bits
    yield ExpectedValue("in two parts", known.apart(restarted(run, setting)), 0.0, "any")
    yield ExpectedValue(
        "in a batch on two threads", known.apart(in_a_batch(run, setting)), 0.0, "any"
    )


CASES = (
    HardCase("HC37", "shifted, turned, mirrored, re-ordered, in parts, beside others", (
        Trial(transformed, (IMPLICIT_1MS, SolverSetting("extrapolated-euler", 1e-6),
                            rk4(1e-5), ROBUST_1MS, DOP853, NDF), quick_settings=2),
    )),
)  # fmt: skip

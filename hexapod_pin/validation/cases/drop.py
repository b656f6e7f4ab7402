"""HC31, HC39, HC40: the hexapod that is set down tilted and moving."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.state import State
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.case_result import ExpectedValue
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS
from hexapod_pin.validation.cases.robots import DATA, answers, references, robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import DOP853, CaseRun, SolverSetting, rk4

Values = Iterator[ExpectedValue]

STIFFNESSES = {
    "soft": {"K": 1e5, "kt": 1e2},
    "mid": {"K": 1e6, "kt": 1e3},
    "stiff": {"K": 1e8, "kt": 1e4},
}
"""HC40's contact stiffness [N/m^1.5] and slope of the friction law [s/m]."""

ADAPTIVE_8 = tuple(SolverSetting(name, 1e-8) for name in ("extrapolated-euler", "ndf", "dop853"))


def drop_numbers(variant: str) -> dict[str, Any]:
    """Return the parameters of HC40 "soft", "mid" or "stiff", SI."""
    return {**references()["HC40_hexapod_drop_soft"]["params"], **STIFFNESSES[variant]}


def drop(
    variant: str, *, duration: float = 0.25, sample: float | None = None, stops: bool = False
) -> CaseRun:
    """Return HC40 "soft", "mid" or "stiff", without joint stops as its references are."""
    numbers = drop_numbers(variant)
    robot = load_robot(robot_file("hexa_ref"))
    contact = Contact(
        normal=HuntCrossley(stiffness=numbers["K"], dissipation=numbers["a"]),
        friction=TanhCoulomb(mu=numbers["mu"], slope=numbers["kt"]),
    )
    servo = Servo(kp=numbers["kp"], kd=numbers["kd"], limited=False)
    scene = Scene(robot, contact=contact, servo=servo, stops=None if stops else NO_JOINT_STOPS)
    start = _tilted(robot, numbers)
    return CaseRun(scene, start, duration, sample, HoldPosture(start.q[7:]))


def _tilted(robot: Robot, numbers: dict[str, Any]) -> State:
    """Return HC40's first state: tilted, moving, some feet already in the ground."""
    import pinocchio as pin

    femur = -0.3
    rotation = pin.rpy.rpyToMatrix(numbers["roll"], numbers["pitch"], 0.0)
    height = 0.09879 + 0.11934 * np.sin(femur) + numbers["clear"]
    posture = np.tile([0.0, femur, -femur], 6)
    q = np.concatenate([[0.0, 0.0, height], pin.Quaternion(rotation).coeffs(), posture])
    v = np.zeros(robot.model.nv)
    v[:3] = rotation.T @ np.array(numbers["vel"])
    return robot.check_state(q, v)


@lru_cache(maxsize=1)
def _scipy_answers() -> dict[str, Any]:
    data: dict[str, Any] = json.loads((DATA / "hc40_references.json").read_text(encoding="utf-8"))
    return data


def end_state(robot: Robot, variant: str) -> State:
    """Return HC40's state at 0.25 s, by SciPy's DOP853 over Pinocchio's ABA."""
    data = _scipy_answers()
    order = [data["joint_order"].index(name) for name in robot.joint_names]
    q, v = np.array(data[variant]["q"]), np.array(data[variant]["v"])
    return robot.check_state(np.r_[q[:7], q[7:][order]], np.r_[v[:6], v[6:][order]])


def catalogue_state(robot: Robot) -> State:
    """Return HC40 soft's state at 0.25 s as the catalogue has it."""
    known = answers("HC40")
    order = [known["joint_order"].index(name) for name in robot.joint_names]
    joints, rates = (np.array(known[key])[order] for key in ("q_joints_pin_order", "v_joints"))
    q = np.array([*known["base_xyz"], *known["quat_xyzw"], *joints])
    return robot.check_state(q, np.array([*known["base_v_local"], *rates]))


# --- HC40 ---------------------------------------------------------------------------------------


def end_of_drop(setting: SolverSetting, variant: str) -> Values:
    """Positions and velocities after 0.25 s."""
    run = drop(variant)
    trace, robot = run.by(setting), run.scene.robot
    known = {"": end_state(robot, variant)}
    if variant == "soft":
        known[" against the catalogue"] = catalogue_state(robot)
        error = float(np.abs(trace.com[-1] - answers("HC40")["com"]).max())
        yield ExpectedValue("centre of mass at 0.25 s, soft", error, 1e-6, "m")
    for name, end in known.items():
        apart = PositionError.between(trace.q[-1:], end.q[np.newaxis]).q
        yield ExpectedValue(f"positions at 0.25 s{name}, {variant}", apart, 1e-6, "m, rad")
        error = float(np.abs(trace.v[-1] - end.v).max())
        yield ExpectedValue(f"velocities at 0.25 s{name}, {variant}", error, 1e-4, "m/s, rad/s")


def large_steps(setting: SolverSetting, tolerance: float) -> Values:
    """The linearly implicit step is first order: 2.7e-3 at 1 ms, 3.8e-4 at 0.1 ms."""
    run = drop("soft")
    end = catalogue_state(run.scene.robot)
    apart = PositionError.between(run.by(setting).q[-1:], end.q[np.newaxis]).q
    yield ExpectedValue("positions at 0.25 s by large steps, soft", apart, tolerance, "m, rad")


# --- HC31 ---------------------------------------------------------------------------------------


def energy_account(setting: SolverSetting, variant: str) -> Values:
    """Nothing is made or lost, losses never shrink."""
    trace = drop(variant, sample=2.5e-3).by(setting)
    lost = trace.energy["normal_loss"][-1] + trace.energy["friction_loss"][-1]
    if lost < 0.01:
        raise ValueError(f"only {lost:g} J were lost in contact")
    residual = float(np.abs(trace.energy_residual).max() / lost)
    yield ExpectedValue(f"energy residual over contact losses, {variant}", residual, 1e-6)
    for name in ("friction_loss", "normal_loss", "joint_damping_loss"):
        back = max(0.0, float(-np.diff(trace.energy[name]).min()))
        # a loss is work less stored energy: its round-off is that of the stored energy
        limit = 1e-8 * lost if setting.adaptive else 0.0
        yield ExpectedValue(f"{name.replace('_', ' ')} runs back, {variant}", back, limit, "J")


# --- HC39 ---------------------------------------------------------------------------------------


def order_in_flight(setting: SolverSetting, order: float) -> Values:
    """Observed order before touch-down."""
    run = drop("soft")
    q = run.start.q.copy()
    q[2] += 0.5
    q[7:] += 0.05  # the servos pull
    start = run.scene.robot.check_state(q, run.start.v)
    found = _observed(CaseRun(run.scene, start, 0.02, None, run.controller), setting)
    note = f"order {found:.2f}"
    yield ExpectedValue("order before touch-down", abs(found - order), 0.2, "-", note)


def order_through_contact(setting: SolverSetting, order: float, band: float) -> Values:
    """Observed order over the whole drop."""
    found = _observed(drop("soft", sample=0.01), setting)
    note = f"order {found:.2f}"
    yield ExpectedValue("order after touch-down", abs(found - order), band, "-", note)


def _observed(run: CaseRun, setting: SolverSetting) -> float:
    """Return by how many halvings the error falls per halving of the step, over two."""
    known = run.by(DOP853).q
    settings = (SolverSetting(setting.method, setting.value / n) for n in (1, 4))
    errors = [PositionError.between(run.by(one).q, known).q for one in settings]
    return 0.5 * math.log2(errors[0] / errors[1])


def _euler(step: float) -> SolverSetting:
    return SolverSetting("implicit-euler", step)


CASES = (
    HardCase("HC31", "energy account through contact", (
        Trial(energy_account, ADAPTIVE_8[:2], variants=(("soft",), ("mid",), ("stiff",)),
              quick_variants=1),
        Trial(energy_account, (rk4(2e-5),), variants=(("soft",),)),
    )),
    HardCase("HC39", "order of convergence, before and through contact", (
        Trial(order_in_flight, (_euler(4e-5),), variants=((1.0,),)),
        Trial(order_in_flight, (rk4(2e-4),), variants=((4.0,),)),
        # the catalogue: the first order of the linear step stays, rk4 falls to 2 .. 2.5
        Trial(order_through_contact, (_euler(4e-4),), variants=((1.0, 0.3),)),
        Trial(order_through_contact, (rk4(2.5e-5),), variants=((2.25, 0.55),), slow=True),
    )),
    HardCase("HC40", "full drop: six stiff feet, friction, servos; 49 numbers", (
        Trial(end_of_drop, (rk4(1e-5), *ADAPTIVE_8), variants=(("soft",),), quick_settings=2),
        Trial(end_of_drop, ADAPTIVE_8, variants=(("mid",),)),
        # dop853 would take 1.7 million evaluations a second: independent truth up to mid
        Trial(end_of_drop, ADAPTIVE_8[:2], variants=(("stiff",),)),
        Trial(large_steps, (_euler(1e-3),), variants=((3e-3,),)),
        Trial(large_steps, (_euler(1e-4),), variants=((5e-4,),)),
    )),
)  # fmt: skip

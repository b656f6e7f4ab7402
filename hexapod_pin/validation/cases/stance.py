"""HC15, HC16, HC17, HC18, HC28: what feet carry at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.ground.terrain import Groove
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import simulate
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.case_result import ExpectedValue, relative
from hexapod_pin.validation.cases.bodies import (
    SIX_FEET,
    SIX_FEET_MASS,
    ball,
    on_ground,
    six_feet_body,
    state,
)
from hexapod_pin.validation.cases.robots import G, answers, robot_file
from hexapod_pin.validation.hard_case import HardCase, NotCovered, Trial
from hexapod_pin.validation.solver_setting import (
    DEFAULT,
    DOP853,
    IMPLICIT_1MS,
    REFERENCE,
    CaseRun,
    SolverSetting,
)

Values = Iterator[ExpectedValue]

# --- HC15 ---------------------------------------------------------------------------------------


def rest_loads(feet: list[str], normal: HuntCrossley, setting: SolverSetting) -> Array:
    """Return the normal forces at rest [N], feet at the height of the mass.

    The catalogue is linear in the tilt; 6e-5 rad change arms and depths by its square.
    """
    from hexapod_pin import native as _native

    robot = six_feet_body((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1), feet)
    depth = (SIX_FEET_MASS * G / len(feet) / normal.stiffness) ** (1.0 / normal.exponent)
    scene = on_ground(robot, normal)
    trace = CaseRun(scene, state(robot, (0.0, 0.0, -depth)), 4.0).by(setting)
    found = _native.evaluate(native_plant(scene), trace.q[-1], trace.v[-1], np.zeros(0))
    forces: Array = np.asarray(found["foot_force"]).reshape(-1, 3)[:, 2]
    return forces


def _critically_damped(stiffness: float, exponent: float, load: float) -> HuntCrossley:
    """Return a law that is damped critically under a load [N] of a sixth of the mass."""
    depth = (load / stiffness) ** (1.0 / exponent)
    spring = exponent * load / depth
    dissipation = 2.0 * math.sqrt(spring * SIX_FEET_MASS / 6.0) / (1.5 * load)
    return HuntCrossley(stiffness=stiffness, exponent=exponent, dissipation=dissipation)


def tripod(setting: SolverSetting, name: str) -> Values:
    """An off-centre mass on three compliant feet."""
    loads = rest_loads(name.split()[1].split(","), _critically_damped(1e9, 1.5, 10.0), setting)
    yield ExpectedValue(f"loads of {name}", _worst(loads, answers("HC15")[name]), 1e-9)


def dropped_tripod(setting: SolverSetting, name: str) -> Values:
    """The same dropped by 0.1 m, with friction: recorded forces 2 s later."""
    robot = six_feet_body((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1), name.split()[1].split(","))
    # much dissipation so that the rest comes soon; forces on level ground have no shear
    normal = HuntCrossley(stiffness=1e9, dissipation=300.0)
    scene = on_ground(robot, normal, friction=TanhCoulomb(mu=0.5, slope=1000.0))
    loads = CaseRun(scene, state(robot, (0.0, 0.0, 0.1)), 2.0).by(setting).foot_force[-1, :, 2]
    worst = _worst(loads, answers("HC15")[name])
    yield ExpectedValue(f"loads of {name}, dropped", worst, 1e-9)
    weight = relative(float(loads.sum()), SIX_FEET_MASS * G)
    yield ExpectedValue(f"weight on {name}, dropped", weight, 1e-9)


def six_springs(setting: SolverSetting, name: str) -> Values:
    """Five and six compliant feet; the catalogue's row of five: R2 lifted, K = 1e6, n = 1.5."""
    case = answers("HC15")["six_compliant"][name]
    five = "R2 lifted" in name
    feet = [foot for foot in SIX_FEET if not (five and foot == "R2")]
    exponent, stiffness = (
        (1.5, 1e6) if five else (float(part.split("=")[1]) for part in name.split(","))
    )
    normal = _critically_damped(stiffness, exponent, SIX_FEET_MASS * G / len(feet))
    worst = _worst(rest_loads(feet, normal, setting), case.get("N_L1..L3,R1..R3", case.get("N")))
    yield ExpectedValue(f"loads of {len(feet)} feet, n = {exponent:g}", worst, 1e-6)


def _worst(found: Array, expected: list[str]) -> float:
    return max(relative(float(f), float(w)) for f, w in zip(found, expected, strict=True))


# --- HC16 ---------------------------------------------------------------------------------------

SMALL_TORQUE = 0.1
"""Torques below it are compared with it, not with themselves [N m]."""


def static_torques(_: None, name: str) -> Values:
    """Joint torques bias - sum J^T f that hold the reference hexapod; its base in balance."""
    from hexapod_pin import native as _native

    robot = load_robot(robot_file("hexa_ref"))
    expected = answers("HC16")
    order = [foot.name.removesuffix("_foot") for foot in robot.feet]
    standing = {"tripod_L1_L3_R2": ["L1", "L3", "R2"], "six_min_norm": expected["foot_order"]}[name]
    q = robot.stand(np.tile([0.0, -0.3, 0.3], 6)).q.copy()
    yield ExpectedValue("height of the base", relative(q[2], expected["base_z"]), 1e-12)
    q[2] -= 1e-13  # in contact, so that the Jacobians are evaluated
    found = _native.evaluate(native_plant(Scene(robot)), q, np.zeros(24), np.zeros(18))
    tau = found["bias"].copy()
    for foot, load in zip(standing, expected[name]["N"], strict=True):
        tau -= load * found["foot_jacobian"][3 * order.index(foot) + 2]
    known = dict(zip(expected["joint_order"], expected[name]["tau"], strict=True))
    exact = np.array([known[joint] for joint in robot.joint_names])
    error = np.abs(tau[6:] - exact) / np.maximum(np.abs(exact), SMALL_TORQUE)
    yield ExpectedValue(f"joint torques, {name}", float(error.max()), 1e-10)
    yield ExpectedValue(f"balance of the base, {name}", float(np.abs(tau[:6]).max()), 1e-9, "N")


def standing_servos(setting: SolverSetting) -> Values:
    """The torque that a stand settles to is the one statics give for its own foot forces."""
    from hexapod_pin import native as _native

    robot = load_robot(robot_file("hexa_ref"))
    scene = Scene(robot, contact=Contact.s1(), servo=Servo(kp=200.0, kd=4.0))
    hold = HoldPosture(np.tile([0.0, -0.3, 0.3], 6))
    trace = simulate(scene, hold, duration=4.0, **setting.arguments)
    found = _native.evaluate(native_plant(scene), trace.q[-1], trace.v[-1], trace.torque[-1])
    statics = found["bias"] - found["foot_jacobian"].T @ trace.foot_force[-1].ravel()
    moving = float(np.abs(trace.torque[-1] - statics[6:]).max())
    note = "what still moves after 4 s"
    yield ExpectedValue("servo torques against statics", moving, 1e-4, "N m", note=note)
    femur = float(np.abs(trace.torque[-1, 1::3] - 0.31).max())
    yield ExpectedValue("femur torques, 0.31 N m", femur, 0.03, "N m")


# --- HC28 ---------------------------------------------------------------------------------------

SPHERE_RADIUS = 0.02
"""[m]"""


def groove(setting: SolverSetting, left: float, right: float, heading: float) -> Values:
    """A sphere of 1 N in V grooves of 45/45 and 30/60 degrees."""
    expected, faces = answers("HC28"), np.radians([left, right])
    ground = Groove(angle_left=faces[0], angle_right=faces[1], depth=0.1, heading=heading)
    robot = ball(SPHERE_RADIUS, mass=1.0 / G)
    normal = HuntCrossley(stiffness=1e6, dissipation=50.0)
    height = ground.lift([np.zeros(3)], [SPHERE_RADIUS])
    scene = on_ground(robot, normal, terrain=ground)
    trace = CaseRun(scene, state(robot, (0.0, 0.0, height)), 3.0).by(setting)
    steep, flat = ("N45_each",) * 2 if left == right else ("N_on_60deg_face", "N_on_30deg_face")
    exact = {round(left): float(expected[flat]), -round(right): float(expected[steep])}
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    errors = [
        relative(float(normal.force(-gap)), exact[round(math.degrees(math.asin(out @ along)))])
        for gap, out in ground.native().contacts(trace.q[-1, :3], SPHERE_RADIUS)
    ]
    name = f"{left:g}/{right:g} degrees, heading {heading:g} rad"
    error = max(errors) if len(errors) == 2 else math.inf
    yield ExpectedValue(f"force on both faces, {name}", error, 1e-6)
    total = float(np.abs(trace.foot_force[-1, 0] - [0.0, 0.0, 1.0]).max())
    yield ExpectedValue(f"sum of the forces, {name}", total, 1e-6, "N")


_TRIPODS = (("tripod L1,L3,R2",), ("tripod L2,R1,R3",))
_QUICK = (DOP853, IMPLICIT_1MS, *REFERENCE[1:])

CASES = (
    HardCase("HC15", "load shares of an over-determined stance", (
        Trial(tripod, _QUICK, variants=_TRIPODS, quick_settings=2),
        Trial(dropped_tripod, (DEFAULT,), variants=_TRIPODS),
        Trial(six_springs, _QUICK, quick_settings=2,
              variants=[(name,) for name in answers("HC15")["six_compliant"]]),
    )),
    HardCase("HC16", "static torques: centre of mass against frame origin", (
        Trial(static_torques, (None,), label="statics",
              variants=(("tripod_L1_L3_R2",), ("six_min_norm",))),
        Trial(standing_servos, (DEFAULT,)),
    )),
    HardCase("HC17", "tipping slope", (
        NotCovered("by compliant contact",
                   "a rigid limit; `hexapod-pin verify --only hc17` has it"),
    )),
    HardCase("HC18", "plastic impact on redundant feet", (
        NotCovered("by compliant contact",
                   "a rigid impact; `hexapod-pin verify --only hc18` has it"),
    )),
    HardCase("HC28", "two contacts of one foot in a groove", (
        Trial(groove, (DOP853, IMPLICIT_1MS, DEFAULT, *REFERENCE[1:]), quick_settings=3,
              variants=[(*faces, heading) for faces, heading in
                        product(((45.0, 45.0), (30.0, 60.0)), (0.0, 0.9))]),
    )),
)  # fmt: skip

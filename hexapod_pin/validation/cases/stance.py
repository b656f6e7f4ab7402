"""HC15, HC16, HC17, HC18, HC28: what feet carry at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.ground.contact import HuntCrossley
from hexapod_pin.ground.terrain import Groove
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import ball, body, on_ground, state
from hexapod_pin.validation.cases.case_result import HardCase, HardRow, relative
from hexapod_pin.validation.cases.reference_data import G, answers
from hexapod_pin.validation.cases.robots import robot_file
from hexapod_pin.validation.cases.solver_settings import (
    MILLISECOND,
    TIGHT,
    Run,
    Wanted,
    measured,
    ways,
)

# --- HC15 ---------------------------------------------------------------------------------------

MASS = 3.08746
PLACES = {
    "L1": (0.2475, 0.16), "L2": (0.0, 0.19), "L3": (-0.2475, 0.16),
    "R1": (0.2475, -0.16), "R2": (0.0, -0.19), "R3": (-0.2475, -0.16),
}  # fmt: skip


def hc15(quick: bool) -> Iterator[HardRow]:
    """An off-centre mass on three and on six compliant feet."""
    wanted = answers("HC15")
    for way in (*ways(quick), *ways(quick, MILLISECOND)):
        for name in ("tripod L1,L3,R2", "tripod L2,R1,R3"):
            feet = name.split()[1].split(",")
            look = partial(_tripod, feet, [float(x) for x in wanted[name]], name)
            yield from measured("HC15", name, way, look, required=TIGHT)
        for name, case in wanted["six_compliant"].items():
            loads = [float(x) for x in case.get("N_L1..L3,R1..R3", case.get("N"))]
            look = partial(_six, name, loads)
            yield from measured("HC15", name, way, look, required=TIGHT)


def _loads(feet: list[str], normal: HuntCrossley, way: Setting) -> Array:
    """Return the normal forces at rest [N], feet at the height of the mass.

    The catalogue is linear in the tilt; 6e-5 rad change arms and depths by its square.
    """
    from hexapod_pin import native as _native

    robot = body(
        {name: (*PLACES[name], 0.0) for name in feet},
        mass=MASS, com=(0.013, -0.007, 0.0), inertia=(0.05, 0.07, 0.1),
    )  # fmt: skip
    depth = (MASS * G / len(feet) / normal.stiffness) ** (1.0 / normal.exponent)
    trace = Run(on_ground(robot, normal), state(robot, (0.0, 0.0, -depth)), 4.0, 4.0).by(way)
    rest = native_plant(on_ground(robot, normal))
    found = _native.evaluate(rest, trace.q[-1], trace.v[-1], np.zeros(0))
    forces: Array = np.asarray(found["foot_force"]).reshape(-1, 3)[:, 2]
    return forces


def _damped(stiffness: float, exponent: float, load: float) -> HuntCrossley:
    """Return a law that is damped critically under a load [N] of MASS/6."""
    depth = (load / stiffness) ** (1.0 / exponent)
    spring = exponent * load / depth
    dissipation = 2.0 * math.sqrt(spring * MASS / 6.0) / (1.5 * load)
    return HuntCrossley(stiffness=stiffness, exponent=exponent, dissipation=dissipation)


def _tripod(feet: list[str], wanted: list[float], name: str, way: Setting) -> Iterator[Wanted]:
    loads = _loads(feet, _damped(1e9, 1.5, 10.0), way)
    yield Wanted(f"loads of {name}", _worst(loads, wanted), 1e-9)


def _six(name: str, wanted: list[float], way: Setting) -> Iterator[Wanted]:
    # the catalogue's row of five feet: R2 lifted, K = 1e6, n = 1.5
    five = "R2 lifted" in name
    feet = [foot for foot in PLACES if not (five and foot == "R2")]
    exponent, stiffness = (1.5, 1e6) if five else _numbers(name)
    loads = _loads(feet, _damped(stiffness, exponent, MASS * G / len(feet)), way)
    yield Wanted(f"loads of {len(feet)} feet, n = {exponent:g}", _worst(loads, wanted), 1e-6)


def _numbers(name: str) -> tuple[float, float]:
    exponent, stiffness = (float(part.split("=")[1]) for part in name.split(","))
    return exponent, stiffness


def _worst(found: Array, wanted: list[float]) -> float:
    return max(relative(float(f), w) for f, w in zip(found, wanted, strict=True))


# --- HC16 ---------------------------------------------------------------------------------------


def hc16(quick: bool) -> Iterator[HardRow]:
    """Joint torques that hold the reference hexapod on three and on six feet."""
    for name in ("tripod_L1_L3_R2", "six_min_norm"):
        yield HardRow("HC16", f"joint torques, {name}", "statics", _torques(name), 1e-10)


def _torques(name: str) -> float:
    """Return the largest error of bias - sum J^T f over the largest torque."""
    from hexapod_pin import native as _native

    robot = load_robot(robot_file("hexa_ref"))
    wanted = answers("HC16")
    order = [foot.name.removesuffix("_foot") for foot in robot.feet]
    standing = {"tripod_L1_L3_R2": ["L1", "L3", "R2"], "six_min_norm": wanted["foot_order"]}[name]
    q = robot.stand(np.tile([0.0, -0.3, 0.3], 6)).q.copy()
    q[2] -= 1e-13  # in contact, so that the Jacobians are evaluated
    found = _native.evaluate(native_plant(Scene(robot)), q, np.zeros(24), np.zeros(18))
    tau = found["bias"].copy()
    for foot, load in zip(standing, wanted[name]["N"], strict=True):
        tau -= load * found["foot_jacobian"][3 * order.index(foot) + 2]
    known = dict(zip(wanted["joint_order"], wanted[name]["tau"], strict=True))
    exact = np.array([known[joint] for joint in robot.joint_names])
    return float(np.abs(tau[6:] - exact).max() / np.abs(exact).max())


# --- HC28 ---------------------------------------------------------------------------------------


def hc28(quick: bool) -> Iterator[HardRow]:
    """A sphere of 1 N in V grooves of 45/45 and 30/60 degrees."""
    for way in (*ways(quick), *ways(quick, MILLISECOND)):
        for left, right in ((45.0, 45.0), (30.0, 60.0)):
            look = partial(_groove, left, right)
            yield from measured("HC28", f"{left:g}/{right:g}", way, look)


def _groove(left: float, right: float, way: Setting) -> Iterator[Wanted]:
    radius, wanted = 0.02, answers("HC28")
    groove = Groove(angle_left=math.radians(left), angle_right=math.radians(right), depth=0.1)
    robot = ball(radius, mass=1.0 / G)
    normal = HuntCrossley(stiffness=1e6, dissipation=50.0)
    height = groove.lift([np.zeros(3)], [radius])
    scene = on_ground(robot, normal, terrain=groove)
    trace = Run(scene, state(robot, (0.0, 0.0, height)), 3.0).by(way)
    if left == right:
        exact = {-1: float(wanted["N45_each"]), 1: float(wanted["N45_each"])}
    else:
        exact = {1: float(wanted["N_on_30deg_face"]), -1: float(wanted["N_on_60deg_face"])}
    errors = [
        relative(float(normal.force(-gap)), exact[int(np.sign(out[0]))])
        for gap, out in groove.native().contacts(trace.q[-1, :3], radius)
    ]
    error = max(errors) if len(errors) == 2 else math.inf
    yield Wanted(f"force on both faces, {left:g}/{right:g} degrees", error, 1e-6)


CASES = (
    HardCase("HC15", "load shares of an over-determined stance", hc15),
    HardCase("HC16", "static torques: centre of mass against frame origin", hc16),
    HardCase("HC17", "tipping slope", None, "rigid contact: `hexapod-pin verify --only hc17`"),
    HardCase("HC18", "plastic impact on redundant feet", None, "`hexapod-pin verify --only hc18`"),
    HardCase("HC28", "two contacts of one foot in a groove", hc28),
)

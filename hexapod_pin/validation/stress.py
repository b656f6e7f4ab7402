"""Random extreme scenes for the robust step: nothing may leave the finite world or gain energy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import DivergenceError
from hexapod_pin.ground.contact import (
    AdamsCoulomb,
    AdamsImpact,
    Contact,
    HuntCrossley,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.terrain import Flat, Slope
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import simulate
from hexapod_pin.text_table import Table
from hexapod_pin.validation.cases.robots import lowest_foot, robot_file
from hexapod_pin.validation.tables import part_verdict

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State

DURATION = 0.5
"""Of every run [s]."""

STEPS = (5e-4, 1e-3, 2e-3)
"""[s]"""

SCENES_PER_PROGRESS = 20

ALLOWED_GAIN = 0.01
"""Of the energy scale of a run."""

HEIGHT = 0.1
"""The weight of the robot over this height is the least energy scale [m]."""

EVENTS = ("deep start", "touch-down", "drag", "slope", "lift-off")
FRICTIONS = ("usual", "falling")
POSTURE = (0.0, -0.3, 0.3)


@dataclass(frozen=True, eq=False)
class StressScene:
    """One random scene.

    Attributes:
        name: its number and event.
        scene: robot, ground, contact, servos.
        initial: state at t = 0.
        targets: (n,) servo set-points, constant [rad].
    """

    name: str
    scene: Scene
    initial: State
    targets: Array


@dataclass(frozen=True)
class StressOutcome:
    """What one run did.

    Attributes:
        name: the scene.
        step: [s].
        finite: it did not diverge.
        gain: largest energy above that at the start, over the energy scale.
        rise: largest rise of energy above an earlier value, over the energy scale.
        injection: energy that the contact solve made, over the energy scale.
        rate_step: largest angle of the base or a joint in one step [rad].
        iterations: mean outer iterations of the nested Newton per step.
        convex: steps that needed the convex finish.
    """

    name: str
    step: float
    finite: bool
    gain: float = np.inf
    rise: float = np.inf
    injection: float = np.inf
    rate_step: float = np.inf
    iterations: float = np.inf
    convex: float = np.inf

    @property
    def passed(self) -> bool:
        """Finite, and no energy gained above the allowed one."""
        return self.finite and self.gain <= ALLOWED_GAIN


def stress_scenes(count: int, seed: int = 0, *, friction: str = "usual") -> Iterator[StressScene]:
    """Yield random scenes of the hard cases' hexapod; scene k depends on the seed and k alone.

    K 1e4..1e9 N/m^n, n 1..2.2, dissipation up to 2 s/m or IMPACT with cmax up to 1e4 N s/m, tanh
    with kt 10..1e5 s/m or a bristle of 1e3..1e7 N/m ("falling": ADAMS' two-speed friction), mu
    0.05..1.2, servos of kp 5..2000; deep starts, touch-downs at 1..3 m/s, dragging, slopes up to
    45 deg, and lifting off from deep, in turn.

    Args:
        count: how many.
        seed: fixes the set.
        friction: "usual" or "falling".
    """
    robot = load_robot(robot_file("hexa_ref"))
    for k in range(count):
        yield _draw(np.random.default_rng((seed, k)), k, robot, friction)


def run_stress(
    scenes: Sequence[StressScene], step: float, *, method: str = "robust"
) -> list[StressOutcome]:
    """Run scenes at one step [s]."""
    return [_run(scene, step, method) for scene in scenes]


def run_stress_set(
    count: int, steps: Sequence[float], progress: Callable[[float], None]
) -> dict[float, list[StressOutcome]]:
    """Run the first scenes at every step [s]; `progress` gets the finished fraction."""
    scenes = list(stress_scenes(count))
    found: dict[float, list[StressOutcome]] = {step: [] for step in steps}
    done = 0
    for step in steps:
        for k in range(0, count, SCENES_PER_PROGRESS):
            part = scenes[k : k + SCENES_PER_PROGRESS]
            found[step] += run_stress(part, step)
            done += len(part)
            progress(done / (count * len(steps)))
    return found


def stress_table(found: Mapping[float, Sequence[StressOutcome]]) -> Table:
    """Return one row per step: runs, failures, extremes, and whether all runs passed."""
    head = (
        "step [ms]", "runs", "not finite", "energy gain above 1 %", "largest gain [%]",
        "largest rise [%]", "contact injection, most", "outer iterations, mean", "result",
    )  # fmt: skip
    rows = tuple(_row(step, outcomes) for step, outcomes in found.items())
    return Table(f"Random extreme scenes, method robust, {DURATION:g} s", head, rows)


def _row(step: float, found: Sequence[StressOutcome]) -> tuple[str, ...]:
    finite = [outcome for outcome in found if outcome.finite]
    return (
        f"{1e3 * step:g}", str(len(found)), str(len(found) - len(finite)),
        str(sum(not outcome.passed for outcome in finite)),
        f"{100 * max((outcome.gain for outcome in finite), default=np.nan):.2g}",
        f"{100 * max((outcome.rise for outcome in finite), default=np.nan):.2g}",
        f"{max((outcome.injection for outcome in finite), default=np.nan):.1e}",
        f"{sum(outcome.iterations for outcome in finite) / max(1, len(finite)):.2f}",
        part_verdict(sum(not outcome.passed for outcome in found), len(found)),
    )  # fmt: skip


def energy_of(trace: Trace, scene: Scene) -> Array:
    """Return kinetic, potential, elastic and servo-spring energy at the samples. Shape (T,) [J].

    From the states alone, whatever the method has recorded.
    """
    kp, _ = scene.servos.gains(scene.robot)
    servo = 0.5 * ((trace.q_ref - trace.q[:, 7:]) ** 2) @ kp
    energy: Array = servo + sum(trace.energy[name] for name in ("kinetic", "potential", "elastic"))
    return energy


def _run(stress: StressScene, step: float, method: str) -> StressOutcome:
    try:
        trace = simulate(
            stress.scene, HoldPosture(tuple(stress.targets)), duration=DURATION, method=method,
            step=step, sample=step, initial=stress.initial,
        )  # fmt: skip
    except DivergenceError:
        return StressOutcome(stress.name, step, finite=False)
    energy, counters = energy_of(trace, stress.scene), trace.counters
    if not np.isfinite(energy).all():
        return StressOutcome(stress.name, step, finite=False)
    weight = stress.scene.robot.total_mass * 9.81 * HEIGHT
    scale = weight + float(trace.energy["kinetic"].max())
    return StressOutcome(
        stress.name,
        step,
        finite=True,
        gain=float(energy.max() - energy[0]) / scale,
        rise=float((energy - np.minimum.accumulate(energy)).max()) / scale,
        injection=float(counters.get("contact_injection", np.nan)) / scale,
        rate_step=float(counters.get("largest_rate_step", np.nan)),
        iterations=float(counters.get("outer_iterations", np.nan)) / counters["steps"],
        convex=float(counters.get("convex_finishes", np.nan)),
    )


def _draw(rng: np.random.Generator, k: int, robot: Robot, friction: str) -> StressScene:
    event = EVENTS[k % len(EVENTS)]
    contact = Contact(normal=_normal(rng), friction=_friction(rng, friction))
    servo = Servo(kp=_log(rng, 5.0, 2000.0), kd=_log(rng, 0.05, 20.0), limited=False)
    angle = np.radians(rng.uniform(10.0, 45.0))
    ground = Slope(angle=angle) if event == "slope" else Flat()
    scene = Scene(robot, terrain=ground, contact=contact, servo=servo)
    targets = np.tile(POSTURE, len(robot.joint_names) // 3)
    return StressScene(f"{k} {event}", scene, _state(rng, scene, event, targets), targets)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _normal(rng: np.random.Generator) -> HuntCrossley | AdamsImpact:
    stiffness, kind = _log(rng, 1e4, 1e9), rng.random()
    exponent = 1.5 if kind < 0.4 else 1.0 if kind < 0.55 else float(rng.uniform(1.0, 2.2))
    if rng.random() < 0.7:
        dissipation = _log(rng, 0.01, 2.0)
        return HuntCrossley(stiffness=stiffness, exponent=exponent, dissipation=dissipation)
    return AdamsImpact(
        stiffness=stiffness,
        exponent=exponent,
        damping=_log(rng, 1.0, 1e4),
        damping_depth=_log(rng, 1e-5, 1e-3),
    )


def _friction(rng: np.random.Generator, kind: str) -> TanhCoulomb | StickSlip | AdamsCoulomb:
    mu = float(rng.uniform(0.05, 1.2))
    if kind == "falling":
        speed = _log(rng, 1e-4, 0.1)
        return AdamsCoulomb(
            mu_static=mu,
            mu_dynamic=mu * float(rng.uniform(0.2, 1.0)),
            stiction_speed=speed,
            transition_speed=speed * float(rng.uniform(1.5, 10.0)),
        )
    if rng.random() < 0.5:
        return TanhCoulomb(mu=mu, slope=_log(rng, 10.0, 1e5))
    stiffness = _log(rng, 1e3, 1e7)
    damping = float(rng.uniform(0.0, 2.0)) * np.sqrt(stiffness * 0.1) * float(rng.random() < 0.5)
    return StickSlip(mu=mu, stiffness=stiffness, damping=damping)


def _state(rng: np.random.Generator, scene: Scene, event: str, targets: Array) -> State:
    """Return a first state: attitude, joints, depth of the deepest foot, velocity by event."""
    import pinocchio as pin

    robot, normal = scene.robot, scene.terrain.surface().normal_at(0.0, 0.0)
    level = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).toRotationMatrix()
    together = event == "touch-down"
    tilt = np.zeros(2) if together else rng.uniform(-0.3, 0.3, 2)
    turn = level @ pin.rpy.rpyToMatrix(tilt[0], tilt[1], rng.uniform(-np.pi, np.pi))
    offsets = np.zeros(len(targets)) if together else rng.uniform(-0.1, 0.1, len(targets))
    q = np.concatenate([np.zeros(3), pin.Quaternion(turn).coeffs(), targets + offsets])
    deep = float(rng.uniform(1e-3, 30e-3)) if event in ("deep start", "lift-off", "slope") else 0.0
    q[:3] = normal * (-lowest_foot(robot, q, normal) - deep)
    v = np.zeros(robot.model.nv)
    v[:3] = turn.T @ _velocity(rng, event, normal)
    v[6:] = 0.0 if together else rng.uniform(-2.0, 2.0, len(targets))
    return robot.check_state(q, v)


def _velocity(rng: np.random.Generator, event: str, normal: Array) -> Array:
    if event == "touch-down":
        return -float(rng.uniform(1.0, 3.0)) * normal
    if event == "lift-off":
        return float(rng.uniform(0.2, 2.0)) * normal
    heading, speed = rng.uniform(-np.pi, np.pi), float(rng.uniform(0.5, 2.0))
    if event == "drag":
        return speed * np.array([np.cos(heading), np.sin(heading), 0.0])
    return np.zeros(3)

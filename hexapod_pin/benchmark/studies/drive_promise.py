"""Does an accuracy hold where drives switch? True errors over random scenes of hard drives.

Weak motors, dry friction, joint stops and set-points that jump, on robots that float or stand and
walk. Each run is compared with DOP853 at 1e-10, which NDF at 1e-9 must confirm.
What a scene makes of an error is measured too: by how much it amplifies a shift of its set-points.
Where that is far above 1, no local error control can keep the accuracy, and references part too.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.benchmark.study import StudyReport
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import DivergenceError
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.plant import standing_on
from hexapod_pin.simulation.run import simulate
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.tables import Table

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State

ACCURACIES = {"extrapolated-euler": (1e-3, 1e-4, 1e-5, 1e-6), "ndf": (1e-5, 1e-6, 1e-7)}
"""Asked for, by method [m, rad]."""

REFERENCE: dict[str, Any] = {"method": "dop853", "accuracy": 1e-10}
CHECK: dict[str, Any] = {"method": "ndf", "accuracy": 1e-9}
SHIFT = 1e-7
"""Of the set-points, for the amplification [rad]."""

CALM = 5.0
"""Amplification up to which a scene tells of the method and not of itself [-]."""
DURATION, SAMPLE = 0.3, 0.01
"""[s]"""

PLACES, HARDSHIPS = ("floating", "standing", "walking"), ("limit", "friction", "stops", "all")


@dataclass(frozen=True)
class JumpingSetPoints:
    """Set-points that jump at their times and are held between. Shapes (K,) [s], (K, n) [rad]."""

    time: Array
    q: Array

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the held reference."""
        return JointTrajectory(
            time=self.time, q=self.q, v=np.zeros_like(self.q), cycle_time=None, steady_from=0.0,
            steady_until=check_duration(duration), travel_direction=np.array([1.0, 0.0]),
            speed=0.0, kind="held",
        )  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        return {"kind": "jumping", "time": self.time.tolist(), "q": self.q.tolist()}


@dataclass(frozen=True)
class ShiftedSetPoints:
    """Another controller's set-points, those of its joints shifted by plus and minus `SHIFT`."""

    controller: Controller

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the shifted reference."""
        plan = self.controller.plan(robot, duration)
        sign = np.where(np.arange(plan.q.shape[1]) % 2, 1.0, -1.0)
        return replace(plan, q=plan.q + SHIFT * sign)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        return {**self.controller.to_dict(), "shift": SHIFT}


@dataclass(frozen=True, eq=False)
class DriveScene:
    """A scene with its commands and its start."""

    name: str
    scene: Scene
    controller: Controller
    initial: State

    def run(self, **settings: Any) -> Array:
        """Return q at the samples (T, nq)."""
        trace = simulate(
            self.scene, self.controller, duration=DURATION, sample=SAMPLE, initial=self.initial,
            **settings,
        )  # fmt: skip
        return trace.q

    def amplification(self, exact: Array) -> float:
        """Return how far set-points shifted by `SHIFT` lead from q (T, nq), in shifts."""
        other = replace(self, controller=ShiftedSetPoints(self.controller))
        return PositionError.between(other.run(**REFERENCE), exact).q / SHIFT


def random_scenes(seed: int, count: int, *, plain: bool = False) -> list[DriveScene]:
    """Return scenes, the same for the same seed; `plain`: without motors and dry friction."""
    rng = np.random.default_rng(seed)
    return [_draw(rng, k, plain) for k in range(count)]


def _draw(rng: np.random.Generator, k: int, plain: bool) -> DriveScene:
    place, hardship = PLACES[k % 3], HARDSHIPS[(k // 3) % 4]
    robot = load_robot(("kharagpur", "athena")[(k // 12) % 2])
    weight = 9.81 * robot.total_mass * 0.05 / 3.0  # N m: a leg's share of it at 5 cm
    strength = (
        float(rng.uniform(1.5, 4.0) if place != "floating" else rng.uniform(0.1, 1.0)) * weight
    )
    servo = _servo(rng, robot, strength, hardship, plain)
    stops = (
        JointStops.from_effort(robot) if hardship in ("stops", "all") else JointStops(stiffness=0.0)
    )
    gravity = (0.0, 0.0, 0.0 if place == "floating" else -9.81)
    scene = Scene(robot, servo=servo, stops=stops, gravity=gravity)
    start, controller = _motion(rng, scene, place, hardship)
    return DriveScene(f"{k + 1} {robot.name} {place} {hardship}", scene, controller, start)


def _servo(
    rng: np.random.Generator, robot: Robot, strength: float, hardship: str, plain: bool
) -> Servo:
    kp = float(np.exp(rng.uniform(np.log(5.0), np.log(200.0)))) * strength
    kd = kp * float(np.exp(rng.uniform(np.log(0.005), np.log(0.05))))
    if plain:
        often = float(robot.effort.max()) / strength
        return Servo(kp=often * kp, kd=often * kd, limited=True)
    from hexapod_pin.drive.motor import Motor

    strong = 1.0 if hardship in ("limit", "all") else 100.0
    dry = float(rng.uniform(0.02, 0.3)) if hardship in ("friction", "all") else 0.0
    motor = Motor(
        stall_torque=strong * strength, no_load_speed=float(rng.uniform(3.0, 12.0)),
        peak_torque=strong * strength * float(rng.uniform(0.6, 1.2)), dry_friction=dry * strength,
        viscous_friction=0.001 * kd, rotor_inertia=1e-7, gear_ratio=float(rng.uniform(50.0, 200.0)),
    )  # fmt: skip
    return Servo(kp=kp, kd=kd, motor=motor)


def _motion(
    rng: np.random.Generator, scene: Scene, place: str, hardship: str
) -> tuple[State, Controller]:
    robot = scene.robot
    start = standing_on(scene, robot.posture)
    if place == "walking":
        cycle = float(rng.uniform(0.5, 1.2))
        return start, KinematicControl(
            Gait.tripod(stroke=float(rng.uniform(0.02, 0.05)), cycle_time=cycle)
        )
    times = np.linspace(0.0, 0.27, 10)
    reach = 0.3 if place == "floating" else 0.08
    q = robot.posture + reach * rng.uniform(-1.0, 1.0, (10, len(robot.joint_names)))
    q[0] = robot.posture
    if hardship in ("stops", "all"):  # beyond the range of every third joint
        q[2:, ::3] = np.where(
            rng.uniform(size=q[2:, ::3].shape) < 0.5, robot.upper[::3] + 0.05, q[2:, ::3]
        )
    else:
        q = np.clip(q, robot.lower, robot.upper)
    state, v = start.q.copy(), start.v.copy()
    if place == "floating":
        state[2] += 1.0
        v[:6] = rng.uniform(-0.3, 0.3, 6)
    return robot.check_state(state, v), JumpingSetPoints(times, q)


@dataclass(frozen=True)
class DriveRow:
    """One run: scene, method, accuracy asked for and error [m, rad]; inf where it did not end."""

    scene: str
    calm: bool
    method: str
    accuracy: float
    error: float

    @property
    def ratio(self) -> float:
        """Error over the accuracy asked for."""
        return self.error / self.accuracy


def measure(scene: DriveScene, methods: Sequence[str]) -> tuple[list[DriveRow], float, float]:
    """Return the rows of a scene, how far its references are apart [m, rad], its amplification."""
    exact = scene.run(**REFERENCE)
    uncertainty = PositionError.between(scene.run(**CHECK), exact).q
    amplification, rows = scene.amplification(exact), []
    for method in methods:
        for accuracy in ACCURACIES[method]:
            try:
                found = PositionError.between(scene.run(method=method, accuracy=accuracy), exact).q
            except DivergenceError:
                found = float("inf")
            rows.append(DriveRow(scene.name, amplification <= CALM, method, accuracy, found))
    return rows, uncertainty, amplification


def drive_promise(
    *, scenes: int = 48, seed: int = 0, methods: str = ",".join(ACCURACIES), plain: bool = False
) -> StudyReport:
    """The accuracy asked for and the error made where drives switch; seed 0: from the clock."""
    seed = seed or time.time_ns() % 10**9
    names = methods.split(",")
    rows: list[DriveRow] = []
    lines: list[tuple[str, ...]] = []
    for scene in random_scenes(seed, scenes, plain=plain):
        own, uncertainty, amplification = measure(scene, names)
        sure = uncertainty < 0.1 * min(row.accuracy for row in own)
        rows += own
        cells = (f"{row.ratio:.2g}{' FAIL' if row.ratio > 1.0 else ''}" for row in own)
        apart = f"{uncertainty:.0e}{'' if sure else ' (!)'}"
        lines.append((scene.name, apart, f"{amplification:.2g}", *cells))
        print(*lines[-1], sep=" | ", file=sys.stderr, flush=True)
    columns = [f"{name} {accuracy:.0e}" for name in names for accuracy in ACCURACIES[name]]
    head = ("scene", "references apart", "amplification", *columns)
    table = Table("Error over accuracy", head, tuple(lines))
    return StudyReport(
        "Accuracy asked for, error made, where drives switch",
        [f"Seed {seed}, {scenes} scenes{', no motors or dry friction' if plain else ''}.",
         _summary(rows), table],
    )  # fmt: skip


def _summary(rows: Sequence[DriveRow]) -> Table:
    head = (
        "method", "accuracy", "ratio, median", "ratio, most", "missed",
        f"ratio, most, amplification up to {CALM:g}", "missed of those",
    )  # fmt: skip
    lines = []
    for method, accuracy in dict.fromkeys((row.method, row.accuracy) for row in rows):
        own = [row for row in rows if (row.method, row.accuracy) == (method, accuracy)]
        median = np.median([row.ratio for row in own])
        parts = (own, [row for row in own if row.calm])
        cells = [cell for part in parts for cell in _worst([row.ratio for row in part])]
        lines.append((method, f"{accuracy:.0e}", f"{median:.2g}", *cells))
    return Table("", head, tuple(lines))


def _worst(ratios: Sequence[float]) -> tuple[str, str]:
    """Return the largest ratio and how many are above 1."""
    missed = sum(ratio > 1.0 for ratio in ratios)
    return f"{max(ratios, default=0.0):.3g}", f"{missed} of {len(ratios)}"

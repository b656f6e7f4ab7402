"""The record and summary of a run, and the error of a run that fails."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hexapod_pin.drive.drive_law import torque_limit
from hexapod_pin.drive.servo import joint_kinds
from hexapod_pin.errors import DivergenceError, WorkLimitError
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.results.joint_budget import joint_kinds as kinds_by_name
from hexapod_pin.results.run_record import (
    Event,
    JointLimits,
    LevelStart,
    Numerics,
    RobotFacts,
    RunCase,
    RunRecord,
    WalkFacts,
)
from hexapod_pin.results.schema import schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.scene.loaded_model import native_loads
from hexapod_pin.scene.robot_file import robot_to_dict

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.scene.loaded_model import NativePoint
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.methods import MethodSettings
    from hexapod_pin.simulation.run_settings import RunSettings


class RunState(Protocol):
    """What this module reads of a run; see `NativeRun`."""

    scene: Scene
    settings: RunSettings
    set_points: JointTrajectory
    start: Checkpoint
    controller: dict[str, Any]
    case_settings: dict[str, Any] | None
    trunk_points: list[NativePoint]
    standing_height: float | None
    rollout: Any
    wall_time: float

    @property
    def time(self) -> float:
        """Simulated time reached [s]."""

    def checkpoint(self) -> Checkpoint:
        """Return where the run stands."""


def run_summary(
    run: RunState,
    record: RunRecord,
    counters: Mapping[str, int | float],
    errors: Mapping[str, Any],
) -> Summary:
    """Return the summary of a run so far."""
    return Summary.from_data(
        run_numbers(run),
        run.scene.robot.joint_names,
        contact_names(run.scene),
        counters,
        record,
        errors,
    )


def run_numbers(run: RunState) -> dict[str, Any]:
    """Return the numbers of a run's summary so far."""
    gathered: dict[str, Any] = run.rollout.summary()
    return dict.fromkeys(schema(Summary)) | gathered


def plain_counters(run: RunState) -> dict[str, int | float]:
    """Return the counters of a run; whole numbers as such."""
    return {
        name: int(count) if float(count).is_integer() else float(count)
        for name, count in run.rollout.counters().items()
    }


def run_record(run: RunState) -> RunRecord:
    """Return the record of a run at its present time, without the URDF and the checkpoint."""
    scene = run.scene
    return RunRecord(
        robot=robot_facts(scene),
        numerics=Numerics(
            method=run.settings.method_settings.method.name,
            accuracy=run.settings.method_settings.accuracy,
            step=run.settings.grid.step,
            sample=run.settings.grid.sample,
            duration=run.settings.duration,
        ),
        walk=WalkFacts.of(run.set_points, run.controller),
        gravity=scene.gravity,
        assumed=scene.assumed,
        events=trunk_events(run),
        limits=joint_limits(run),
        level_start=level_start(run),
        wall_time=run.wall_time,
        case=RunCase(scene.settings, robot_to_dict(scene.robot), run.controller, run.case_settings),
    )


def with_urdf(record: RunRecord, run: RunState) -> RunRecord:
    """Return a record with what a trace needs in addition: URDF, checkpoint, versions."""
    robot = record.robot.model_copy(update={"urdf": run.scene.robot.urdf})
    more = {"robot": robot, "checkpoint": run.checkpoint(), "versions": package_versions()}
    return record.model_copy(update=more)


def robot_facts(scene: Scene) -> RobotFacts:
    """Return what a record keeps of a scene's robot."""
    robot = scene.robot
    return RobotFacts(
        name=robot.name,
        provenance=robot.provenance,
        digest=robot.digest,
        total_mass=scene.total_mass,
        joint_kinds=named_joint_kinds(robot),
        effort_limit=tuple(torque_limit(robot, scene.servos).tolist()),
        velocity_limit=tuple(robot.velocity_limit.tolist()),
        foot_radius=tuple(contact_radii(scene)),
        doubts=scene.robot.doubts,
    )


def contact_radii(scene: Scene) -> list[float]:
    """Return the radii of all contact points, feet first [m]."""
    body = native_loads(scene.robot, scene.settings).body_points
    radii = [foot.radius for foot in scene.robot.feet] + [radius for _, _, radius, _ in body]
    return [float(radius) for radius in radii]


def level_start(run: RunState) -> LevelStart | None:
    """Return z of level ground and of the trunk's origin where the motion began [m]."""
    ground, height = run.scene.terrain, run.standing_height
    if height is None and run.start.time == 0.0:
        height = float(run.start.q[2]) - getattr(ground, "height", 0.0)
    if not isinstance(ground, Flat) or height is None:
        return None
    return LevelStart(ground=ground.height, trunk=ground.height + height)


def named_joint_kinds(robot: Robot) -> tuple[str, ...] | None:
    """Return `joint_kinds` of a robot with legs where names and order do not show them."""
    if not robot.legs:
        return None
    kinds = joint_kinds(robot)
    found = tuple(kinds[name] for name in robot.joint_names)
    return None if found == kinds_by_name(robot.joint_names, len(robot.feet)) else found


def joint_limits(run: RunState) -> tuple[JointLimits, ...]:
    """Return how often and how long each joint was at its limits so far."""
    columns = run.rollout.drive_counters()
    return tuple(
        JointLimits(joint=name, limit_count=int(n), limit_time=float(t), stop_count=int(stops))
        for name, n, t, stops in zip(run.scene.robot.joint_names, *columns, strict=True)
    )


def trunk_events(run: RunState) -> tuple[Event, ...]:
    """Return where the trunk has touched the ground so far."""
    return tuple(
        Event(
            time=time, kind="trunk-contact", what=run.trunk_points[point][3],
            place=tuple(place.tolist()),
        )
        for time, point, place in run.rollout.trunk_touches()
    )  # fmt: skip


@cache
def package_versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    from importlib.metadata import version

    return {name: version(name) for name in ("hexapod-pin", "pin", "numpy")}


# The message of a run that ended early: the cause, where it occurred, and what to change.

TRUNK = ("the trunk's place", "the trunk's attitude")
"""What the first six coordinates of a velocity belong to, three each."""


def contact_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of all contact points: the feet, then those of the trunk, if it has any."""
    body = native_loads(scene.robot, scene.settings).body_points
    return (*(foot.name for foot in scene.robot.feet), *(name for _, _, _, name in body))


def failure(run: RunState, trace: Trace | None) -> DivergenceError:
    """Return the error of a run that left the finite world or was ended by its limits.

    Args:
        run: the run.
        trace: its samples so far; None where none are recorded.
    """
    limit = run.rollout.ended_by
    if limit:
        return WorkLimitError(_ended(run, limit), trace, limit)
    time, rate = run.time, run.rollout.checkpoint().v[6:]
    if trace is not None:
        time, rate = float(trace.time[-1]), trace.v[-1, 6:]
    causes = [*_fastest_joint(rate, run.scene.robot.joint_names), *_loaded_foot(trace)]
    text = f"the run diverged after t = {time:g} s ({'; '.join(causes)}). "
    return DivergenceError(text + _advice(run.settings.method_settings), trace)


def _ended(run: RunState, limit: str) -> str:
    """Return the message of a run that was ended by its limits."""
    settings, scene = run.settings, run.scene
    reached = {
        "evaluations": f"{settings.evaluations:.3g} evaluations are used up",
        "smallest_step": f"its steps are shorter than {settings.limits.smallest_step:g} s",
        "wall_time": f"{settings.limits.wall_time:g} s of wall time are used up",
        "stopped": "it was stopped",
    }[limit]
    step, coordinate, foot = run.rollout.trouble()
    causes = [f"last step {step:.2g} s"]
    if coordinate >= 0:
        causes.append(f"limited by the error of {_coordinate(coordinate, scene)}")
    if foot >= 0:
        laws = " + ".join(
            type(law).__name__ for law in (scene.contact.normal, scene.contact.friction)
        )
        causes.append(f"most loaded foot {contact_names(scene)[foot]}, {laws}")
    return (
        f"the run was ended at t = {run.time:g} s: {reached} ({'; '.join(causes)}). Try another "
        f"method than {settings.method_settings.method.name!r}, a looser accuracy or softer "
        "contact, or raise "
        f"limits=hp.simulation.WorkLimits({limit}=...); allow=True (--force) lifts all limits."
    )


def _coordinate(index: int, scene: Scene) -> str:
    return TRUNK[index // 3] if index < 6 else scene.robot.joint_names[index - 6]


def _fastest_joint(rate: Array, names: tuple[str, ...]) -> list[str]:
    if not rate.size:
        return []
    joint = int(np.abs(rate).argmax())
    return [f"fastest joint {names[joint]} at {abs(rate[joint]):.3g} rad/s"]


def _loaded_foot(trace: Trace | None) -> list[str]:
    if trace is None or "contacts" not in trace.recorded or not trace.foot_names:
        return []
    force = np.linalg.norm(trace.foot_force[-1], axis=1)
    foot = int(force.argmax())
    return [f"most loaded foot {trace.foot_names[foot]} with {force[foot]:.3g} N"]


def _advice(method_settings: MethodSettings) -> str:
    if method_settings.method.adaptive:
        return (
            f"No step of {method_settings.method.name!r} met the accuracy "
            f"{method_settings.accuracy:g}: try method='robust', softer contact, or lower servo "
            "gains."
        )
    return (
        f"Try a smaller step than {method_settings.step:g} s, method='robust', softer contact, or "
        "lower servo gains."
    )

"""What is known of a run besides its samples: robot, scene, controller, settings, events.

`simulate` makes a `RunRecord`; budgets, views, verdicts and files read its fields. It holds no
robot of Pinocchio's and no simulator: a trace can be read when the robot's file is gone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, InstanceOf

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import Bound, FileData, Name, NotNegative, Number, check_data, per
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.scene.settings import SceneSettings
from hexapod_pin.spec import parsed_toml

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory

PerJoint = Annotated[tuple[Bound | None, ...], Field(strict=False), per("joint")]
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]


class Facts(FileData):
    """Base of the parts of a record: frozen, checked, and as they stand in files."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)


class RobotFacts(Facts):
    """The robot that a run was made with; None where it is not known.

    Attributes:
        name: of the robot.
        provenance: where its numbers come from.
        digest: `Robot.digest`.
        urdf: its URDF, with what was recognised in it.
        total_mass: with its loads [kg].
        joint_kinds: of every joint, where names and places do not show it.
        effort_limit: of every joint at standstill [N m]; None or infinite without one.
        velocity_limit: of every joint [rad/s].
        foot_radius: of every contact point [m].
        doubts: what in its file makes torques doubtful, in short phrases.
    """

    name: Name = "robot"
    provenance: str = ""
    digest: str = ""
    urdf: str | None = None
    total_mass: NotNegative | None = None
    joint_kinds: Annotated[tuple[Name, ...], Field(strict=False), per("joint")] | None = None
    effort_limit: PerJoint | None = None
    velocity_limit: PerJoint | None = None
    foot_radius: Annotated[tuple[NotNegative, ...], Field(strict=False), per("foot")] | None = None
    doubts: Annotated[tuple[str, ...], Field(strict=False)] = ()

    @property
    def mass(self) -> float:
        """With its loads [kg]; NaN where it is not known."""
        return math.nan if self.total_mass is None else self.total_mass

    def effort(self, joints: int) -> Array:
        """Return the torque limits of so many joints [N m]; infinite where there is none.

        Raises:
            ParameterError: the record has limits of another number of joints.
        """
        return _limits("effort_limit", self.effort_limit, joints)

    def velocity(self, joints: int) -> Array:
        """Return the rate limits of so many joints [rad/s]; infinite where there is none.

        Raises:
            ParameterError: the record has limits of another number of joints.
        """
        return _limits("velocity_limit", self.velocity_limit, joints)

    def radii(self, feet: int) -> Array:
        """Return the radii of so many contact points [m]; 0 where they are not known."""
        return np.zeros(feet) if self.foot_radius is None else np.array(self.foot_radius)


def _limits(name: str, given: Sequence[float | None] | None, joints: int) -> Array:
    if given is None:
        return np.full(joints, np.inf)
    if len(given) != joints:
        hint = "Robot and trace are of two runs: take both from one, or leave the limits out."
        allowed = f"{joints} numbers, one for each joint of the trace"
        raise ParameterError(f"run.robot.{name}", len(given), allowed, hint)
    return np.array([math.inf if limit is None else limit for limit in given], dtype=float)


class Numerics(Facts):
    """How a run was integrated and sampled; None where it is not known.

    Attributes:
        method: its name.
        accuracy: error in positions that was requested [m and rad]; None with fixed steps.
        step: of a fixed-step method [s].
        sample: time between samples [s].
        duration: requested [s].
        tolerance: of a step, in the run that is reported [m and rad].
        accuracy_kept: whether the estimated error is within the accuracy.
        error_estimate: how far any position may be off [m and rad].
        cycles_run: cycles of a walk that was run until it repeats, the last of which is reported.
        transients: how far positions are at most from those of the walk for ever [m and rad].
        torque_transients: and torques [N m].
    """

    method: Name | None = None
    accuracy: NotNegative | None = None
    step: NotNegative | None = None
    sample: NotNegative | None = None
    duration: NotNegative | None = None
    tolerance: NotNegative | None = None
    accuracy_kept: bool = False
    error_estimate: Bound | None = None
    cycles_run: Annotated[int, Field(ge=1)] | None = None
    transients: NotNegative | None = None
    torque_transients: NotNegative | None = None


class WalkFacts(Facts):
    """What a controller planned.

    Attributes:
        cycle_time: of a gait [s]; None where nothing repeats.
        steady_from: when steady walking begins [s].
        steady_until: when it ends [s]; None: at the end of the run.
        travel_direction: unit vector of travel at the start, world axes [-].
        nominal_speed: mean speed of the body [m/s]; None where it is not known.
        turn_rate: of the gait [rad/s], left > 0.
    """

    cycle_time: Annotated[Number, Field(ge=1e-6)] | None = None
    steady_from: Number = 0.0
    steady_until: Bound | None = None
    travel_direction: Pair = (1.0, 0.0)
    nominal_speed: Number | None = None
    turn_rate: Number = 0.0

    @classmethod
    def of(cls, plan: JointTrajectory, controller: Mapping[str, Any]) -> WalkFacts:
        """Return the facts of a plan; the turn rate is that of the controller's gait."""
        gait = controller.get("gait")
        rate = gait.get("turn_rate") if isinstance(gait, Mapping) else None
        if isinstance(rate, bool) or not isinstance(rate, int | float):
            rate = 0.0
        x, y = plan.travel_direction
        return cls(
            cycle_time=plan.cycle_time,
            steady_from=plan.steady_from,
            steady_until=plan.steady_until,
            travel_direction=(float(x), float(y)),
            nominal_speed=float(plan.speed),
            turn_rate=float(rate),
        )

    @property
    def speed(self) -> float:
        """Mean speed of the body [m/s]; 0 where it is not known."""
        return self.nominal_speed or 0.0


class LevelStart(Facts):
    """Heights at the start of a run from rest on level ground, world axes [m].

    Attributes:
        ground: of the ground.
        trunk: of the trunk's origin.
    """

    ground: Number
    trunk: Number


class Event(Facts):
    """Something that happened.

    Attributes:
        time: [s].
        kind: "trunk-contact": a point of the trunk came to touch the ground.
        what: name of the part.
        place: where, world axes [m].
    """

    time: NotNegative
    kind: Name
    what: Name
    place: Triple

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**self.model_dump(), "place": list(self.place)}


class JointLimits(Facts):
    """What one joint met in a whole run, by its accepted steps.

    Attributes:
        joint: its name.
        limit_count: times its torque limit was reached.
        limit_time: time at the limit [s].
        stop_count: times it ran into a stop.
    """

    joint: Name
    limit_count: Annotated[int, Field(ge=0)]
    limit_time: NotNegative
    stop_count: Annotated[int, Field(ge=0)]


ORDER = ("schema", "run", "controller", "scene", "initial")
"""Tables of a case's text."""


@dataclass(frozen=True, eq=False)
class RunCase(Immutable):
    """What was run: scene, controller and settings, as objects or as the text of a file.

    Attributes:
        scene_settings: of the scene; None of a case that was read from a file, or is not known.
        robot: how the robot was loaded, as `robot_to_dict` gives it.
        controller_data: the controller as plain data.
        settings: what `Case.to_toml` writes besides; empty of a session, which has no case.
        text: the case as TOML text, where it was read from a file.
    """

    scene_settings: SceneSettings | None = None
    robot: Mapping[str, Any] | None = None
    controller_data: Mapping[str, Any] | None = None
    settings: Mapping[str, Any] | None = None
    text: str = ""

    @cached_property
    def data(self) -> Mapping[str, Any]:
        """Everything as plain data: the tables "controller", "scene" and those of `settings`.

        Raises:
            ParameterError: the text of a file is no TOML.
        """
        if self.scene_settings is None or self.robot is None:
            return parsed_toml(self.text)
        parts = {
            **(self.settings or {}),
            "controller": self.controller_data or {},
            "scene": self.scene_settings.with_robot(self.robot),
        }
        return {name: parts[name] for name in ORDER if name in parts}

    @cached_property
    def scene(self) -> SceneSettings | None:
        """Ground, contact, servos, loads; None where they are not known.

        Raises:
            ParameterError: the text of a file holds none; names the entry.
        """
        if self.scene_settings is not None or "scene" not in self.data:
            return self.scene_settings
        return SceneSettings.from_dict(self.data["scene"])

    @cached_property
    def controller(self) -> Mapping[str, Any]:
        """The controller as plain data; empty where it is not known."""
        if self.controller_data is not None:
            return self.controller_data
        found = self.data.get("controller", {})
        return found if isinstance(found, Mapping) else {}

    @property
    def robot_file(self) -> Mapping[str, Any]:
        """How the robot was loaded; empty where it is not known."""
        return self.robot or self.data.get("scene", {}).get("robot", {})

    @property
    def feet(self) -> tuple[str, ...] | None:
        """The robot's foot links; None where they are not known."""
        feet = self.robot_file.get("feet")
        return None if feet is None else tuple(feet)

    def to_toml(self) -> str:
        """Return everything as TOML text; that of a file as it was read."""
        if self.text or not self.data:
            return self.text
        import tomli_w

        return tomli_w.dumps(dict(self.data))


class RunFacts(Facts):
    """The parts of a record as they stand in a file."""

    robot: RobotFacts = RobotFacts()
    numerics: Numerics = Numerics()
    walk: WalkFacts = WalkFacts()
    gravity: Triple = (0.0, 0.0, -9.81)
    assumed: Annotated[tuple[str, ...], Field(strict=False)] = ()
    events: Annotated[tuple[Event, ...], Field(strict=False)] = ()
    limits: Annotated[tuple[JointLimits, ...], Field(strict=False), per("joint")] | None = None
    level_start: LevelStart | None = None
    versions: dict[str, str] = {}
    wall_time: NotNegative | None = None


class RunRecord(RunFacts):
    """What is known of a run besides its samples and numbers.

    Attributes:
        robot: name, limits, mass, URDF.
        numerics: method, accuracy, samples, and what is known of the error.
        walk: what the controller planned.
        gravity: acceleration, world axes [m/s^2].
        assumed: statements of every number that no source gives.
        events: what happened, in the order of time.
        limits: what each joint met; None where it was not counted.
        level_start: heights at the start of a run from rest on level ground.
        versions: of the packages that the numbers depend on.
        wall_time: that the run took [s].
        case: what was run.
        checkpoint: where the run stood at its end.
    """

    case: InstanceOf[RunCase] = Field(default_factory=RunCase, exclude=True)
    checkpoint: InstanceOf[Checkpoint] | None = Field(default=None, exclude=True)

    def to_dict(self) -> dict[str, Any]:
        """Return the facts as plain data: `case` and `checkpoint` are not among them."""
        return self.model_dump(exclude_defaults=True)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], case: str = "", **sizes: int) -> RunRecord:
        """Return the record of `to_dict`.

        Args:
            data: plain data.
            case: what was run, as TOML text.
            sizes: numbers of joints and contact points, by "joint" and "foot".

        Raises:
            ParameterError: an entry breaks its rule; names it.
        """
        return cls(**dict(check_data(RunFacts, "run", data, **sizes)), case=RunCase(text=case))

    @property
    def of_summary(self) -> RunRecord:
        """The same without what only a trace keeps: URDF, checkpoint and versions."""
        robot = self.robot.model_copy(update={"urdf": None})
        return self.model_copy(update={"robot": robot, "checkpoint": None, "versions": {}})

    @property
    def scene(self) -> SceneSettings | None:
        """Ground, contact, servos, loads; None where they are not known."""
        return self.case.scene

    @property
    def prescribed(self) -> bool:
        """Whether the joints followed their set-points exactly."""
        return self.scene is not None and self.scene.prescribed

    @property
    def case_data(self) -> Mapping[str, Any]:
        """The case that was run, as plain data.

        Raises:
            ParameterError: the run was that of a session, or its case is not known.
        """
        if "run" not in self.case.data:
            hint = "A session is led from outside; it has no case."
            raise ParameterError("run.case", sorted(self.case.data), "that of a case's run", hint)
        return self.case.data

    @property
    def case_toml(self) -> str:
        """The same as TOML text: what `hexapod-pin run` takes.

        Raises:
            ParameterError: as `case_data`.
        """
        return self.case.to_toml() if self.case_data else ""


UNKNOWN = RunRecord()
"""Of a trace that was made by hand."""

"""S1's foot control is a closed-loop controller, prepared for one robot and scene."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import digest
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.foot_control.law import (
    TARGET_SIZE,
    assumed_servo,
    law_settings,
    native_law,
)
from hexapod_pin.control.foot_control.leg_model import (
    PlannedWalk,
    first_posture,
    known_joints,
    known_scene,
    leg_chains,
    once,
)
from hexapod_pin.control.foot_control.parameters import (
    NUMBERS,
    ControlParts,
    Levelling,
    SlipPid,
    TouchDown,
    VirtualSuspension,
)
from hexapod_pin.control.foot_control.stability import refuse_unstable, with_stable_gains
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import LegGroup, leg_group, require_six_of_three
from hexapod_pin.errors import ParameterError, ReachError, SensorError, UnknownNameError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.native import FootControlLaw


# Foot control prepared for one robot and scene: numbers for the native core.

FIELDS = ("q", "v", "torque", "rotation", "angular_velocity", "acceleration", "foot_force")
"""Readings in the order in which the core checks them."""

SHARES = (0.75, 0.5, 0.25, 0.0)
"""Of what moves a foot from its plan, tried in turn where a leg cannot reach all of it."""


@dataclass(frozen=True, eq=False)
class ReadyLaw:
    """The law of one controller on one robot.

    Attributes:
        law: in the core.
        walk: the plan.
        six: the legs.
        lead: from a tick until its command has arrived [s].
        joints: of the robot that it knows, indices of those of the scene's. Shape (m,).
        count: how many joints the scene's robot has.
        joint_names: for messages.
        foot_names: for messages.
    """

    law: FootControlLaw
    walk: PlannedWalk
    six: LegGroup
    lead: float
    joints: NDArray[np.intp]
    count: int
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]

    def first_memory(self, batch: int) -> Array:
        """Return the memory before the first tick. Shape (B, N)."""
        return np.tile(self.law.first_memory(), (batch, 1))

    def tick(self, time: float, m: Measurement, memory: Array) -> tuple[Array, Array]:
        """Return the feet's targets and the memory after the tick at `time` [s].

        Targets are those at the end of the command. Shape (B, 6, `TARGET_SIZE`).

        Raises:
            SensorError: a reading is not finite.
        """
        self.walk.reach(time + self.lead)
        targets, after = np.empty((len(memory), 6, TARGET_SIZE)), np.empty_like(memory)
        q, v, torque, rotation, rate, acceleration, force = (
            np.ascontiguousarray(self._known(name, m)) for name in FIELDS
        )
        row, (field, place) = self.law.update(
            self.walk.table, time, q, v, torque, rotation, rate, acceleration, force,
            memory, after, targets,
        )  # fmt: skip
        if row >= 0:
            raise self._fault(m, int(row), FIELDS[field], int(place))
        return targets, after

    def _known(self, name: str, m: Measurement) -> Array:
        """Return a reading, of the joints that the controller knows."""
        reading: Array = getattr(m, name)
        whole = name not in ("q", "v", "torque") or len(self.joints) == self.count
        return reading if whole else reading[:, self.joints]

    def set_points(self, time: float, targets: Array) -> tuple[Array, Array]:
        """Return joint angles [rad] and rates [rad/s] for the targets of a tick. (B, n) each.

        A foot out of reach stops between plan and target.

        Raises:
            ReachError: of a leg that cannot even reach its planned place.
        """
        feet = targets[..., :3]
        try:
            q = self.six.joint_angles(feet)
        except ReachError:
            q = np.concatenate([self._within_reach(time, row) for row in feet])
        v = np.zeros_like(q)
        self.law.set_points(targets, q, v)
        return self._of_all(q), self._of_all(v)

    def _of_all(self, values: Array) -> Array:
        """Return values (B, m) of the known joints with 0 for the gaps of gears. (B, n)."""
        if len(self.joints) == self.count:
            return values
        found = np.zeros((len(values), self.count))
        found[:, self.joints] = values
        return found

    def _within_reach(self, time: float, feet: Array) -> Array:
        """Return the angles (1, n) of one robot, legs out of reach nearer to their plan."""
        plan = self.walk.table.at(time + self.lead)[:, :3]
        wanted = feet.copy()
        for leg in range(6):
            for share in (1.0, *SHARES):
                wanted[leg] = plan[leg] + share * (feet[leg] - plan[leg])
                try:
                    self.six.legs[leg].inverse(wanted[leg])
                except ReachError:
                    continue
                break
        return self.six.joint_angles(wanted[None])

    def _fault(self, m: Measurement, row: int, field: str, place: int) -> SensorError:
        """Return the error that names a reading that is not finite."""
        names = {"q": self.joint_names, "v": self.joint_names, "torque": self.joint_names}
        if field == "foot_force":
            of = f" of {self.foot_names[place // 3]}"
        else:
            of = f" of {names[field][place]}" if field in names else ""
        value = self._known(field, m)[row].ravel()[place]
        return SensorError(f"{field}{of}", float(value), m.time, row)


def ready_law(control: FootControl, scene: Any, *, refuse: bool = True) -> ReadyLaw:
    """Return the law of a controller for a scene.

    Args:
        control: the controller.
        scene: what it controls.
        refuse: whether to refuse gains with which the loop would be unstable.

    Raises:
        ParameterError: a leg without servo stiffness, or gains that make the loop unstable.
        GaitError, ReachError: the robot cannot walk the plan.
    """
    joints, count = known_joints(scene.robot), len(scene.robot.joint_names)
    scene = known_scene(scene)
    robot, six = scene.robot, leg_group(scene.robot)
    for servo in (scene.servos, assumed_servo(control, scene)):
        stiffness = servo.gains(robot)[0][six.joint_index]
        if not (stiffness > 0.0).all():
            raise ParameterError(
                "Servo.kp", float(stiffness.min()), "above 0 N m/rad at the joints of legs",
                "Foot control moves feet through their servos.",
            )  # fmt: skip
    control = with_stable_gains(control, scene)
    if refuse:
        refuse_unstable(control, scene)
    lead = control.period + control.delay
    return ReadyLaw(
        law=native_law(scene, law_settings(control, scene), leg_chains(scene)),
        walk=PlannedWalk(robot, control.walk),
        six=six,
        lead=lead,
        joints=joints,
        count=count,
        joint_names=tuple(robot.joint_names),
        foot_names=tuple(foot.name for foot in robot.feet),
    )


# S1's foot control as a closed-loop controller.

MOST_RUNS = 1_000_000
"""Largest number of runs in lock-step."""


@checked
@dataclass(frozen=True, eq=False)
class FootControl(ControlParts):
    """Walk a plan whose feet react to their forces; inverse kinematics at every tick [S1].

    Each part can be left out; without any this is kinematic control at ticks.

    Attributes:
        walk: a `Gait`, or an open-loop walk such as `KinematicControl`: planned feet and schedule.
        slip: correction of the feet along the ground.
        force_targets: forces that the feet are to carry.
        suspension: legs yield to their loads.
        touch_down: feet stop at the ground, search for it, and rise over what stops them.
        levelling: keeps the trunk level.
        force: how the robot obtains the forces on its feet.
        sensors: its sensors; None: ideal ones.
        servo: whose gains kp and kd it counts on; None: the scene's. Other gains are an error of
            its model: the joints have those of the scene.
        load_time: in which a foot takes up its share of the weight about its touch-down, and gives
            it back about its lift-off [s]. The default is *assumed*.
        period: time between ticks [s].
        delay: time from a tick until its command acts [s].

    Raises:
        ParameterError: a part of another type, or a time out of range.
    """

    _ready: OrderedDict[str, ReadyLaw] = field(
        default_factory=OrderedDict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Check the times; a gait alone is walked by `KinematicControl`."""
        for name, allowed in NUMBERS.items():
            value = getattr(self, name)
            if not (value > 0.0 or (value == 0.0 and name == "delay")):
                raise ParameterError(f"FootControl.{name}", value, allowed)
        if isinstance(self.walk, Gait):
            object.__setattr__(self, "walk", KinematicControl(self.walk))
        if not hasattr(self.walk, "path") or not hasattr(self.walk, "gait"):
            raise ParameterError(
                "FootControl.walk", type(self.walk).__name__, "a Gait, or an open-loop walk"
            )

    def posture(self, scene: Any) -> Array:
        """Return the joint angles of the plan's beginning, in which a run starts [rad].

        Raises:
            GaitError: the robot has other than six legs of three joints, holds joints, or cannot
                walk the plan.
        """
        _require_scene("FootControl.posture", scene)
        known = known_scene(scene).robot
        require_six_of_three(known, "FootControl", held=False)
        angles = np.zeros(len(scene.robot.joint_names))
        angles[known_joints(scene.robot)] = first_posture(known, self.walk)
        return angles

    def start_key(self, scene: Any) -> str:
        """Return a key of all that gains depend on: scenes of equal keys can run in lock-step."""
        _require_scene("FootControl.start_key", scene)
        robot, drive = scene.robot, scene.servos.model_dump_json() + scene.contact.model_dump_json()
        return digest(f"{robot.digest} {robot.posture} {robot.feet} {scene.gravity} {drive}")

    def start(self, scene: Any, batch: int) -> dict[str, Any]:
        """Return the memory before the first tick of `batch` runs in lock-step.

        Raises:
            ParameterError: gains with which the loop would be unstable, with the range; a batch
                of no runs or of more than `MOST_RUNS`.
            GaitError, ReachError: the robot has other than six legs of three joints, holds joints,
                or cannot walk the plan.
        """
        if not 1 <= batch <= MOST_RUNS:
            raise ParameterError("FootControl.start.batch", batch, f"from 1 to {MOST_RUNS}")
        key = self.start_key(scene)

        def make() -> ReadyLaw:
            require_six_of_three(known_scene(scene).robot, "FootControl", held=False)
            return ready_law(self, scene)

        return {"scene": key, "memory": once(self._ready, key, make).first_memory(batch)}

    @every_step
    def update(
        self, time: float, measurement: Measurement, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return angles and rates of the joints at the end of the tick's command, and the memory.

        Raises:
            SensorError: a reading is not finite.
        """
        law = self._ready[state["scene"]]
        targets, memory = law.tick(time, measurement, state["memory"])
        q, v = law.set_points(time, targets)
        return Command(q, v, ramp=True), {**state, "memory": memory}


def _require_scene(call: str, scene: Any) -> None:
    """Refuse an object that is no scene; this layer does not import the type.

    Raises:
        ParameterError: it lacks an attribute of a `Scene`.
    """
    if not all(hasattr(scene, name) for name in ("robot", "servos", "contact", "gravity")):
        raise ParameterError(f"{call}.scene", type(scene).__name__, "a Scene")


# Foot control by name, as S1 compares it.

S1_PARTS: dict[str, dict[str, type]] = {
    "slip": {"slip": SlipPid},
    "suspension": {"suspension": VirtualSuspension},
    "both": {"slip": SlipPid, "suspension": VirtualSuspension},
    "all": {
        "slip": SlipPid, "suspension": VirtualSuspension,
        "touch_down": TouchDown, "levelling": Levelling,
    },
}  # fmt: skip
"""Parts of each kind of foot control, with their default (*assumed*) numbers."""

CONVENTIONAL = "conventional"
"""The walk as it is planned: S1's kinematic control."""


def named_controls(walk: Any, names: Sequence[str] = (CONVENTIONAL, *S1_PARTS)) -> dict[str, Any]:
    """Return controllers of one walk by name: "conventional", "slip", "suspension", "both", "all".

    "all" adds reactions at touch-down, and levelling. Use it on unknown ground.

    Args:
        walk: a gait or an open-loop walk, as of `FootControl`.
        names: which.

    Raises:
        UnknownNameError: there is no such controller.
    """
    found: dict[str, Any] = {}
    for name in names:
        if name != CONVENTIONAL and name not in S1_PARTS:
            raise UnknownNameError("controller", name, [CONVENTIONAL, *S1_PARTS])
        parts = {part: kind() for part, kind in S1_PARTS.get(name, {}).items()}
        control = FootControl(walk, **parts)
        found[name] = control if parts else control.walk
    return found

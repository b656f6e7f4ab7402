"""S1's foot control as a controller that takes part in a run."""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import digest
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.foot_control.foot_force_sensing import FootForceSensing
from hexapod_pin.control.foot_control.levelling import Levelling
from hexapod_pin.control.foot_control.planned_walk import first_posture
from hexapod_pin.control.foot_control.ready_law import ReadyLaw, ready_law
from hexapod_pin.control.foot_control.slip_pid import SlipPid
from hexapod_pin.control.foot_control.touch_down import TouchDown
from hexapod_pin.control.foot_control.virtual_suspension import VirtualSuspension
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.control.six_legs import require_six_of_three
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

MOST_RUNS = 1_000_000
"""Most runs in lock-step."""

KEPT_SCENES = 64
"""For how many scenes a controller stays ready."""

PARTS = {
    "slip": SlipPid, "suspension": VirtualSuspension, "touch_down": TouchDown,
    "levelling": Levelling, "force": FootForceSensing, "sensors": Sensors,
}  # fmt: skip
"""The parts of foot control that are parameter sets."""

NUMBERS = {
    "load_time": "finite and above 0 s",
    "period": "finite and above 0 s",
    "delay": "finite and not negative [s]",
}
"""Its other settings, and what they may be."""


@checked
@dataclass(frozen=True, eq=False)
class FootControl(Immutable):
    """Walk a plan whose feet are moved by what they feel; inverse kinematics at every tick [S1].

    Each part can be left out; without any this is kinematic control at ticks.

    Attributes:
        walk: a `Gait`, or an open-loop walk such as `KinematicControl`: planned feet and schedule.
        slip: correction of the feet along the ground.
        suspension: legs yield to their loads.
        touch_down: feet stop at the ground, search for it, and rise over what stops them.
        levelling: keeps the trunk level.
        force: what the robot takes for the forces on its feet.
        sensors: through which it reads; None: ideal ones.
        load_time: in which a foot takes up its share of the weight about its touch-down, and gives
            it back about its lift-off [s]. The default is *assumed*.
        period: time between ticks [s].
        delay: time from a tick until its command acts [s].

    Raises:
        ParameterError: a part of another type, or a time out of range.
    """

    walk: Any
    slip: SlipPid | None = field(default=None, kw_only=True)
    suspension: VirtualSuspension | None = field(default=None, kw_only=True)
    touch_down: TouchDown | None = field(default=None, kw_only=True)
    levelling: Levelling | None = field(default=None, kw_only=True)
    force: FootForceSensing = field(default_factory=FootForceSensing, kw_only=True)
    sensors: Sensors | None = field(default=None, kw_only=True)
    load_time: float = field(default=0.1, kw_only=True)
    period: float = field(default=0.005, kw_only=True)
    delay: float = field(default=0.0, kw_only=True)
    _ready: OrderedDict[str, ReadyLaw] = field(
        default_factory=OrderedDict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Check the parts and the times; a gait alone is walked by `KinematicControl`."""
        for name, kind in PARTS.items():
            part = getattr(self, name)
            if not isinstance(part, kind) and not (part is None and name != "force"):
                raise ParameterError(f"FootControl.{name}", part, f"{kind.__name__} or None")
        for name, allowed in NUMBERS.items():
            value = getattr(self, name)
            if not isinstance(value, int | float) or not (
                math.isfinite(value) and (value > 0.0 or (value == 0.0 and name == "delay"))
            ):
                raise ParameterError(f"FootControl.{name}", value, allowed)
        if isinstance(self.walk, Gait):
            object.__setattr__(self, "walk", KinematicControl(self.walk))
        if not hasattr(self.walk, "path") or not hasattr(self.walk, "gait"):
            raise ParameterError(
                "FootControl.walk", type(self.walk).__name__, "a Gait, or an open-loop walk"
            )

    @property
    def gait(self) -> Gait:
        """The gait that is walked."""
        gait: Gait = self.walk.gait
        return gait

    @property
    def loop_delay(self) -> float:
        """Time from a measurement until its command acts [s]."""
        return self.delay + (self.sensors.delay if self.sensors else 0.0)

    def posture(self, scene: Any) -> Array:
        """Return the joint angles of the plan's beginning, in which a run starts [rad].

        Raises:
            GaitError: the robot has other than six legs of three joints, holds joints, or cannot
                walk the plan.
        """
        _require_scene("FootControl.posture", scene)
        require_six_of_three(scene.robot, "FootControl", held=False)
        return first_posture(scene.robot, self.walk)

    def start_key(self, scene: Any) -> str:
        """Return what gains follow from: scenes with equal ones can be run in lock-step."""
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
        if key not in self._ready:
            require_six_of_three(scene.robot, "FootControl", held=False)
            self._ready[key] = ready_law(self, scene)
            while len(self._ready) > KEPT_SCENES:
                self._ready.popitem(last=False)
        return {"scene": key, "memory": self._ready[key].first_memory(batch)}

    def update(
        self, time: float, measurement: Measurement, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the joint angles for the end of the tick's command, and the memory after it.

        Raises:
            SensorError: a reading is not finite.
        """
        law = self._ready[state["scene"]]
        feet, memory = law.tick(time, measurement, state["memory"])
        return Command(law.joint_angles(time, feet), ramp=True), {**state, "memory": memory}

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        settings: dict[str, Any] = {"kind": "foot-control"}
        settings |= {name: getattr(self, name) for name in NUMBERS}
        settings["walk"] = self.walk.to_dict()
        settings["gait"] = settings["walk"].get("gait", {})
        for name in PARTS:
            part = getattr(self, name)
            if part is not None:
                settings[name] = json.loads(part.model_dump_json())
        return settings


def _require_scene(call: str, scene: Any) -> None:
    """Refuse what is no scene; this layer knows none by its type.

    Raises:
        ParameterError: it has not what a `Scene` has.
    """
    if not all(hasattr(scene, name) for name in ("robot", "servos", "contact", "gravity")):
        raise ParameterError(f"{call}.scene", type(scene).__name__, "a Scene")

"""A walking task to be learned: its commands, what is randomised, actions and rewards."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from hexapod_pin.control.gait import Gait
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.simulation.run_settings import RunSettings, WorkLimits
from hexapod_pin.spec import Spec

Range = float | tuple[float, float]
"""A number, or the least and the largest of a uniform distribution."""

OBSERVED = (
    "command", "gravity", "angular_velocity", "heading", "phase", "q", "v", "loaded", "action",
)  # fmt: skip
"""What is observed where nothing is chosen."""

ALL_OBSERVED = (*OBSERVED, "torque", "acceleration", "foot_force")

SET_POINT_SCALE, OFFSET_SCALE = 0.4, 0.15
"""Largest change of a joint's set-point by an action [rad], *assumed*: from the standing posture,
and from a planned gait."""

ACCURACY = 1e-3
"""Of each step of an adaptive method, where none is chosen [m and rad]."""


class RewardWeights(Spec):
    """Weights of the terms of the reward, which is their sum; `period` is the task's, in seconds.

    Attributes:
        velocity: + velocity period exp(-|u - u*|^2 / s^2) [1/s]; u is the mean velocity of the
            trunk during the step in axes that turn with it about the vertical [m/s], u* the
            commanded one, s `velocity_width` of the largest commanded speed.
        heading: + heading period exp(-(h - h*)^2 / s^2) [1/s]; h is the trunk's heading [rad], h*
            the commanded one, which turns at the commanded rate, s `heading_width`.
        tilt: - tilt period sin^2(a) [1/s]; a is the angle between the trunk's z axis and the normal
            of the ground where that is a plane, else the vertical [rad].
        power: - power period sum |torque rate| / (m g v) [1/s], at the end of the step; m is the
            mass of the robot with its loads [kg], v the largest commanded speed [m/s].
        smoothness: - smoothness period mean (a - a')^2 [1/s], of this action and the one before.
        fall: - fall once where the episode terminates [-].
        velocity_width: [-].
        heading_width: [rad].

    All defaults are *assumed*. Without a fall a perfect walk earns 1.5 a second, less its power.
    """

    velocity: NonNegativeFloat = 1.0
    heading: NonNegativeFloat = 0.5
    tilt: NonNegativeFloat = 1.0
    power: NonNegativeFloat = 0.05
    smoothness: NonNegativeFloat = 0.02
    fall: NonNegativeFloat = 1.0
    velocity_width: PositiveFloat = 0.5
    heading_width: PositiveFloat = 0.3


class WalkTask(Spec):
    """Follow a commanded velocity: what an episode draws, what a policy does, sees and earns.

    A range is a number, or (least, largest), from which each episode draws.

    Attributes:
        speed: commanded forward speed [m/s]; None: half to all of that of the gait, as fitted.
        heading: commanded direction of travel from the trunk's forward axis, left positive [rad].
        turn_rate: commanded yaw rate, left positive [rad/s].
        friction: coefficient of friction [-]; None: that of the scene's contact. The default is
            *assumed*.
        slope: inclination of the ground [rad], rising in a random direction.
        bumps: largest height of smooth random hills, 0.3 m apart, one of 32 fields [m].
        period: time between two actions [s].
        duration: time after which an episode is truncated, a whole number of periods [s].
        action: "set-points": of the joints, around the standing posture; "gait": offsets on the
            set-points of a planned gait, which is walked at the commanded speed.
        action_scale: largest change of a set-point, for an action of 1 [rad; of a sliding joint m,
            times the length of the leg]; None: 0.4 around the posture, 0.15 on a gait.
        gait: its name, or the gait itself; its cycle is the clock that `phase` observes. None: the
            robot's default.
        cycle_time: of the gait at the largest speed [s]; None: fitted.
        observe: the parts of an observation, in this order.
        sensors: what they are read with; their delay is at most a period.
        method, accuracy, step: as of `hp.simulate`, without an estimate of the error of a whole
            run: "extrapolated-euler" at 1e-3 where none is given.
        reward: weights of its terms.
        largest_tilt: a trunk that leans by more has fallen [rad]; *assumed*.
        least_height: a trunk lower than this share of its height at the start has fallen [-];
            *assumed*.

    Raises:
        ParameterError: a value out of range, or settings that do not fit together.
    """

    speed: Range | None = None
    heading: Range = 0.0
    turn_rate: Range = 0.0
    friction: Range | None = (0.5, 0.9)
    slope: Range = 0.0
    bumps: Range = 0.0
    period: Annotated[float, Field(ge=1e-3, le=1.0)] = 0.02
    duration: Annotated[float, Field(gt=0.0, le=60.0)] = 10.0
    action: Literal["set-points", "gait"] = "set-points"
    action_scale: PositiveFloat | None = None
    gait: str | Gait | None = None
    cycle_time: PositiveFloat | None = None
    observe: tuple[str, ...] = OBSERVED
    sensors: Sensors = Sensors()
    method: str | None = None
    accuracy: PositiveFloat | None = None
    step: PositiveFloat | None = None
    reward: RewardWeights = RewardWeights()
    largest_tilt: Annotated[float, Field(gt=0.0, le=math.pi)] = 0.8
    least_height: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.4

    def __init__(self, /, **fields: Any) -> None:
        """Validate the fields, and whether they fit together."""
        super().__init__(**fields)
        for name, least, most in LIMITS:
            self._check_range(name, least, most)
        if abs(self.steps * self.period - self.duration) > 1e-9 * self.duration:
            allowed = f"a whole number of periods of {self.period:g} s"
            raise ParameterError("WalkTask.duration", self.duration, allowed)
        unknown = [name for name in self.observe if name not in ALL_OBSERVED]
        if unknown or len(set(self.observe)) < len(self.observe) or not self.observe:
            allowed = f"some of {', '.join(ALL_OBSERVED)}, each once"
            raise ParameterError("WalkTask.observe", self.observe, allowed)
        if self.sensors.delay > self.period:
            allowed = f"at most the period, {self.period:g} s"
            raise ParameterError("WalkTask.sensors.delay", self.sensors.delay, allowed)
        if self.action == "gait" and (is_range(self.heading) or is_range(self.turn_rate)):
            allowed = "a number each where the action is 'gait': the path is planned once"
            value = (self.heading, self.turn_rate)
            raise ParameterError("WalkTask.heading, turn_rate", value, allowed)
        _ = self.settings  # refuses methods

    def _check_range(self, name: str, least: float, most: float) -> None:
        """Refuse a range whose ends are out of order, or beyond limits.

        Raises:
            ParameterError: it is one.
        """
        value = getattr(self, name)
        if value is None:
            return
        low, high = ends(value)
        if not least <= low <= high <= most:
            allowed = f"a number or (least, largest), from {least:g} to {most:g}"
            raise ParameterError(f"WalkTask.{name}", value, allowed)

    @property
    def steps(self) -> int:
        """Actions of an episode that is truncated [-]."""
        return max(1, round(self.duration / self.period))

    @property
    def settings(self) -> RunSettings:
        """How an episode is integrated."""
        accuracy, known = self.accuracy, METHODS.get(self.method or "")
        adaptive = self.step is None if known is None else known.adaptive
        if accuracy is None and adaptive:
            accuracy = ACCURACY
        return RunSettings.of(
            self.duration, self.method, accuracy, None, self.step, None,
            estimate=False, limits=WorkLimits(),
        )  # fmt: skip

    @property
    def integration(self) -> str:
        """Method, and accuracy or step, of the integration, as text."""
        return self.settings.accuracy_text


LIMITS = (
    ("speed", 1e-3, 10.0), ("heading", -math.pi, math.pi), ("turn_rate", -10.0, 10.0),
    ("friction", 0.0, 10.0), ("slope", 0.0, 0.8), ("bumps", 0.0, 0.2),
)  # fmt: skip
"""Fields that are ranges, with their smallest and largest values [SI]."""


def ends(value: Range) -> tuple[float, float]:
    """Return the least and the largest number of a range."""
    return value if isinstance(value, tuple) else (float(value), float(value))


def is_range(value: Range) -> bool:
    """Tell whether an episode may draw different numbers."""
    low, high = ends(value)
    return low < high

"""These are the parameters of foot control.

They cover slip correction, force targets, virtual suspension, levelling, touch-down and sensing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator, model_serializer

from hexapod_pin.control.sensors import Sensors
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler

    from hexapod_pin.control.gait import Gait


class _Sparse(Spec):
    """Parameters that are dumped without those that are None."""

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}


class SlipPid(_Sparse):
    """PID on the tangential force of standing feet, or on how far they have slid [S1].

    "force": e is the part of a foot's tangential force that drives the trunk nowhere: the force
    less the share of the sum and of the moment about the normal that goes with its load. The foot
    gives way along it, dp = kp e + ki int e + kd e'.
    "slip": e is how far a foot has slid since touch-down, by joint angles and gyroscope: its
    motion less the feet's mean. The foot is put back, dp = -(kp e + ki int e + kd e').

    S1 prints neither equations nor gains. Gains that are not given follow from the bandwidth by
    internal model control [Skogestad2003]: ki = 1 / (s (1/w + d)), kp = kd = 0, w = 2 pi bandwidth,
    d the delay of the loop, s the stiffness along the ground of the stiffest foot on its servos
    [N/m], of "slip" 1: a standing foot has no lag of its own (*assumed*). With neither ki nor a
    bandwidth given ki is halved until the loop of the standing robot is stable with twice its
    value.

    Beside `ForceTargets` e of "force" is the deviation from them (`ForceTargets.deviation`).

    Attributes:
        signal: what e is.
        kp: [m/N]; of "slip" [-].
        ki: [m/(N s)]; of "slip" [1/s].
        kd: [m s/N]; of "slip" [s].
        bandwidth: of the loop, for gains that are not given [Hz]; None: 10, beside force targets 7
            (*assumed*), or less where the loop wants it.
        derivative_time: of the low-pass filter of e' [s]. The default is *assumed*.
        limit: largest correction; at it the integral stops (anti-windup) [m]. *Assumed*.
        anticipates: whether set-points compensate the compliance of the servos under the vertical
            loads f0 (not in S1), by tau = g - J^T f0 over kp, g of the leg's own weight, behind a
            low-pass filter of kd / kp: without, the load pushes feet apart, and what the PID
            corrects slides again as the foot unloads. `ForceTargets` do this with their forces.
    """

    kind: Literal["slip-pid"] = "slip-pid"
    signal: Literal["force", "slip"] = "force"
    kp: NonNegativeFloat | None = None
    ki: NonNegativeFloat | None = None
    kd: NonNegativeFloat | None = None
    bandwidth: PositiveFloat | None = None
    derivative_time: PositiveFloat = 0.01
    limit: PositiveFloat = 0.03
    anticipates: bool = True

    @property
    def assumed(self) -> bool:
        """Whether a gain is this package's guess rather than the user's number."""
        return None in (self.kp, self.ki)


# S1's virtual suspension: a leg yields to its load as if it stood on a spring and a damper.

DELAYS_PER_PERIOD = 0.03
"""Frequency times delay of a suspension whose frequency is not given: 4 Hz at ticks of 5 ms."""

LEAST_DELAY = 4.5e-3
"""Least delay there: contacts are not stable with quicker legs than 6.7 Hz [s] (*assumed*)."""


class VirtualSuspension(_Sparse):
    """Admittance along the normal of the support, m z'' + c z' + k z = f - f0, z the retraction.

    S1 prints no equations or gains; these are of mass-spring-damper form with m = k / w^2 and
    c = 2 zeta k / w, w = 2 pi frequency. The nominal load f0 is the normal part of what the foot is
    to carry: its force target, without `ForceTargets` its share of the weight (balance of force and
    moments, least squares), or a constant. A foot with half of its load or less yields and does not
    reach; one that finds no ground reaches for it 0.1 s after its planned touch-down.

    The errors f - f0 are split into modes: heave, their sum, shared by the feet; tilt, their
    moments; warp, the rest. Of each a share is yielded to; with all three 1 it is leg by leg, as
    S1. Tilt yields to the moments of the trunk itself, which is why it is left out by default.

    Attributes:
        stiffness: k [N/m]; None: retracts by `travel` under a sixth of the weight.
        travel: [m]. The default is *assumed*.
        frequency: of the undamped mass on its spring [Hz]; None: 0.03 / d, d the delay of the
            loop, 4.5 ms at least (*assumed*).
        damping: zeta, 1 is critical [-]. The default is *assumed*.
        load: "split" of the weight, or the same for every standing foot [N].
        limit: largest travel in both directions [m]. *Assumed*.
        heave: share of the sum of the errors that legs yield to [-].
        tilt: share of their moments [-].
        warp: share of the rest [-].
    """

    kind: Literal["virtual-suspension"] = "virtual-suspension"
    stiffness: PositiveFloat | None = None
    travel: PositiveFloat = 0.002
    frequency: PositiveFloat | None = None
    damping: PositiveFloat = 1.6
    load: Literal["split"] | PositiveFloat = "split"
    limit: PositiveFloat = 0.03
    heave: NonNegativeFloat = 1.0
    tilt: NonNegativeFloat = 0.0
    warp: NonNegativeFloat = 1.0

    @field_validator("load", mode="before")
    @classmethod
    def _split_or_force(cls, value: Any) -> Any:
        """Refuse other values with an error that names both alternatives."""
        if value == "split" or (isinstance(value, int | float) and 0.0 < value < math.inf):
            return value
        raise ParameterError("VirtualSuspension.load", value, '"split", or a force above 0 N')

    def resolved(self, weight: float, delay: float) -> tuple[float, float]:
        """Return stiffness [N/m] and frequency [Hz] for a weight [N] and a loop's delay [s]."""
        stiffness = weight / (6.0 * self.travel) if self.stiffness is None else self.stiffness
        own = DELAYS_PER_PERIOD / max(delay, LEAST_DELAY)
        frequency = own if self.frequency is None else self.frequency
        return stiffness, frequency

    def gains(self, weight: float, delay: float) -> tuple[float, float, float]:
        """Return m [kg], c [N s/m] and k [N/m]; arguments as of `resolved`."""
        stiffness, frequency = self.resolved(weight, delay)
        rate = 2.0 * math.pi * frequency
        return stiffness / rate**2, 2.0 * self.damping * stiffness / rate, stiffness


# Forces that feet are to carry, and set-points that make them do so.


class Sole(_Sparse):
    """How the sole of a foot deflects: f_n = stiffness depth^exponent, f_t = sliding_stiffness way.

    A push test gives the numbers of a robot.

    Attributes:
        stiffness: along the normal [N/m^exponent].
        exponent: 1 is linear, 1.5 a sphere [-].
        sliding_stiffness: along the ground, of a foot that sticks [N/m]; None: rigid.
    """

    kind: Literal["sole"] = "sole"
    stiffness: PositiveFloat
    exponent: Annotated[float, Field(ge=1.0, le=3.0)] = 1.5
    sliding_stiffness: PositiveFloat | None = None


class ForceTargets(_Sparse):
    """Feet are to carry the forces that need the least torques of the joints (not in S1).

    The targets f balance the weight, with the least sum of (torque / effort)^2 / w; w is the weight
    of a foot, which rises about its planned touch-down and falls about its lift-off within
    `FootControl.load_time`. Where a foot would leave its friction cone, all targets go as far as
    needed towards vertical ones. Set-points are offset by the torques g - J^T f over kp, g of the
    legs' own weight, behind a low-pass filter of kd / kp: servos then give these torques where the
    plan is followed.

    Attributes:
        friction: largest tangential force over normal force of a target [-]. *Assumed*.
        damping: cost of a force itself, over the mean cost of its torques [-]. *Assumed*.
        upright_time: of the low-pass filter of the measured direction of gravity [s]. *Assumed*.
        sole: whose deflection under the targets is compensated, too: a `Sole`, or "contact", that
            of the scene's contact law; None: unknown.
        deviation: from what `SlipPid` corrects: "segment", the forces between none and the target
            in proportion to the load, or "target", which also pulls feet up to their target.
    """

    kind: Literal["force-targets"] = "force-targets"
    friction: PositiveFloat = 0.35
    damping: PositiveFloat = 0.02
    upright_time: NonNegativeFloat = 0.2
    sole: Sole | Literal["contact"] | None = None
    deviation: Literal["segment", "target"] = "segment"


# Levelling: the legs put a trunk level that stands on a slope.


class Levelling(Spec):
    """Integral control of roll and pitch as the trunk's orientation sensor has them.

    Attributes:
        bandwidth: of the loop [Hz]. The default is *assumed*.
        limit: largest tilt of the feet's plane against the trunk; a steeper slope leaves the rest
            [rad]. The default is *assumed*: legs must reach, and a level trunk comes near a slope.
    """

    kind: Literal["levelling"] = "levelling"
    bandwidth: PositiveFloat = 0.3
    limit: Annotated[float, Field(gt=0.0, le=math.pi / 4)] = 0.06

    @property
    def rate(self) -> float:
        """Of the integral [1/s]."""
        return 2.0 * math.pi * self.bandwidth


# Touch-down by foot forces, and a trunk that follows the ground under its feet.


class TouchDown(Spec):
    """Feet that stop where they meet the ground, search for it, and rise over obstacles.

    All defaults are *assumed*.

    Attributes:
        earliest: share of the swing before which no ground is expected [-].
        search_speed: of a foot that moves on downwards [m/s].
        search_depth: how far below the plan it goes; there it waits [m].
        rise_speed: of a swinging foot that runs against something [m/s].
        rise_limit: how far above the plan it rises [m].
        retreat_speed: of such a foot, back from what it met [m/s].
        patience: longest time that the walk waits for a foot that finds no ground; 0: none [s].
        lost_after: time without load after which a standing foot searches [s].
        height_time: in which the trunk's height follows the mean of the standing feet [s].
        tilt_time: in which the trunk's tilt follows the plane of the standing feet [s].
    """

    kind: Literal["touch-down"] = "touch-down"
    earliest: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    search_speed: PositiveFloat = 0.1
    search_depth: NonNegativeFloat = 0.03
    rise_speed: PositiveFloat = 0.2
    rise_limit: NonNegativeFloat = 0.04
    retreat_speed: NonNegativeFloat = 0.05
    patience: NonNegativeFloat = 0.3
    lost_after: PositiveFloat = 0.3
    height_time: PositiveFloat = 0.5
    tilt_time: PositiveFloat = 1.5


# How a robot obtains the forces on its feet.


class FootForceSensing(_Sparse):
    """Where foot forces come from, and when a foot counts as touching.

    "foot": sensors in the feet. "torque": from the joints' torques, J^-T (tau_leg - tau), with
    tau_leg what the leg's own weight and motion need (Newton-Euler; joint accelerations from two
    ticks) and tau the motors' torques less what friction takes from them. "current": the same from
    the motors' torques as they are, friction unknown. Noise, delay and rounding are those of
    `Sensors`.

    Attributes:
        source: of the forces.
        cutoff: of a first-order low-pass filter on them [Hz]; None: no filter.
        threshold: a foot with more force than this touches, one with less than a quarter is free
            [N]; None: 4, 12 or 20 % of the robot's weight for the three sources (*assumed*).
    """

    kind: Literal["foot-force-sensing"] = "foot-force-sensing"
    source: Literal["foot", "torque", "current"] = "foot"
    cutoff: PositiveFloat | None = None
    threshold: PositiveFloat | None = None

    @property
    def filter_time(self) -> float:
        """Time constant of the filter [s]."""
        return 0.0 if self.cutoff is None else 1.0 / (2.0 * math.pi * self.cutoff)


PARTS = {
    "slip": SlipPid, "force_targets": ForceTargets, "suspension": VirtualSuspension,
    "touch_down": TouchDown,
    "levelling": Levelling, "force": FootForceSensing, "sensors": Sensors, "servo": Servo,
}  # fmt: skip
"""The parts of foot control that are parameter sets."""

NUMBERS = {
    "load_time": "finite and above 0 s",
    "period": "finite and above 0 s",
    "delay": "finite and not negative [s]",
}
"""Its other settings, and their allowed ranges."""


@dataclass(frozen=True, eq=False)
class ControlParts(Immutable):
    """The settings of a foot controller; `FootControl` describes them."""

    walk: Any
    slip: SlipPid | None = field(default=None, kw_only=True)
    force_targets: ForceTargets | None = field(default=None, kw_only=True)
    suspension: VirtualSuspension | None = field(default=None, kw_only=True)
    touch_down: TouchDown | None = field(default=None, kw_only=True)
    levelling: Levelling | None = field(default=None, kw_only=True)
    force: FootForceSensing = field(default_factory=FootForceSensing, kw_only=True)
    sensors: Sensors | None = field(default=None, kw_only=True)
    servo: Servo | None = field(default=None, kw_only=True)
    load_time: float = field(default=0.07, kw_only=True)
    period: float = field(default=0.005, kw_only=True)
    delay: float = field(default=0.0, kw_only=True)

    @property
    def gait(self) -> Gait:
        """The gait that is walked."""
        gait: Gait = self.walk.gait
        return gait

    @property
    def loop_delay(self) -> float:
        """Time from a measurement until its command acts [s]."""
        return self.delay + (self.sensors.delay if self.sensors else 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        settings: dict[str, Any] = {"kind": "foot-control"}
        settings |= {name: getattr(self, name) for name in NUMBERS}
        settings["walk"] = self.walk.to_dict()
        settings["gait"] = settings["walk"].get("gait", {})
        for name in PARTS:
            part = getattr(self, name)
            if part is not None:
                settings[name] = part.model_dump(mode="json")
        return settings

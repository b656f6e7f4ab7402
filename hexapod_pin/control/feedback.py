"""Closed-loop control: the measurements of a controller at its ticks, and its commands.

Arrays may have leading axes: none for `Session.measure`, one of length B for a controller, whose
same NumPy code then serves a single run (B = 1) and B runs in lock-step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from numpy.typing import NDArray

from hexapod_pin.arguments import every_step
from hexapod_pin.arrays import Array

if TYPE_CHECKING:
    import numpy as np

State = Any
"""Memory of a controller: None, numbers, arrays, or mappings and sequences of them."""


@every_step
@dataclass(frozen=True, eq=False)
class Measurement:
    """Measured quantities at one time, n joints and F feet, after leading axes.

    Attributes:
        time: of the measurement [s].
        q: joint angles, `Robot.joint_names` order [rad]. (..., n).
        v: joint rates [rad/s]. (..., n).
        torque: of the drives on the joints [N m]. (..., n).
        rotation: trunk axes to world axes. (..., 3, 3).
        angular_velocity: of the trunk, trunk axes [rad/s]. (..., 3).
        acceleration: what an accelerometer at the trunk's origin reads, trunk axes: acceleration
            less gravity, so (0, 0, 9.81) at rest [m/s^2]. (..., 3).
        foot_force: of the ground on the feet, world axes [N]. (..., F, 3).
        loaded: whether the ground pushes on a foot. (..., F).
    """

    time: float
    q: Array
    v: Array
    torque: Array
    rotation: Array
    angular_velocity: Array
    acceleration: Array
    foot_force: Array
    loaded: NDArray[np.bool_]


@every_step
@dataclass(frozen=True, eq=False)
class Command:
    """Set-points of the joint drives, `Robot.joint_names` order; (B, n) each from a controller.

    Attributes:
        q: joint angles [rad].
        v: joint rates [rad/s]. With a ramp those at its end; None: the mean rates of its motion.
            Without a ramp those until the next command; None: 0.
        torque: added to the drives' own [N m]; None: 0.
        ramp: False: constant until the next command. True: the angles go to `q` and arrive at the
            next tick, on cubics that begin with the angles and rates of the set-points: both are
            continuous from tick to tick. After the end of the motion the set-points rest.
    """

    q: Array
    v: Array | None = None
    torque: Array | None = None
    ramp: bool = False


@runtime_checkable
class FeedbackController(Protocol):
    """A closed-loop controller. It is pure: its state is an argument and a result.

    Attributes:
        period: time between ticks [s]; tick k is at k * period.

    It may also have:
        delay: time from a tick until its command acts [s]; 0 without it.
        sensors: its `Sensors`; ideal ones without.
        gait: the `Gait` it walks, which gives the trace its cycles.
        posture: a method (scene) -> joint angles (n,) [rad] in which a run starts.
        start_key: a method (scene) -> a hashable value of all that `start` uses of the scene: cases
            run in lock-step where it is equal. Without it `start` may use the robot alone.
        to_dict: a method that returns its settings as TOML-able data with the key "kind".
    """

    @property
    def period(self) -> float:
        """Time between ticks [s]."""
        ...

    def start(self, scene: Any, batch: int) -> State:
        """Return the state before the first tick of `batch` runs of a `Scene` in lock-step."""
        ...

    def update(self, time: float, measurement: Measurement, state: State) -> tuple[Command, State]:
        """Return the command of the tick at `time` [s], and the state after it."""
        ...

"""One scene of the study of accuracy: what moves, on what, for how long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.simulation.case import simulate

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


@dataclass(frozen=True)
class SceneLabels:
    """What results are grouped by: kind of motion, robot, laws, ground, drives."""

    kind: str
    robot: str
    normal: str
    friction: str
    terrain: str
    drive: str

    def __str__(self) -> str:
        """Return the labels in one line."""
        return (
            f"{self.kind}, {self.robot}, {self.normal} + {self.friction}, {self.terrain}, "
            f"{self.drive}"
        )

    def to_dict(self) -> dict[str, str]:
        """Return plain data."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class PromiseScene:
    """A scene with its commands and its start.

    Attributes:
        labels: what it is made of.
        scene: robot, ground, contact, drives, loads.
        controller: gives the joint set-points.
        initial: state at t = 0; None: standing at the first set-point.
        duration: simulated time [s], a whole number of samples.
        sample: time between compared samples [s].
        answer: positions at the samples known in closed form (T, 7 + n) [m, -, rad]; None if not.
    """

    labels: SceneLabels
    scene: Scene
    controller: Controller | FeedbackController
    initial: State | None
    duration: float
    sample: float
    answer: Array | None = None

    def run(self, progress: Callable[[float], None] | None = None, **settings: Any) -> Trace:
        """Return the trace by `simulate` with these settings (method, accuracy).

        Raises:
            HexapodError: the method refuses the scene, or diverges.
        """
        closed = isinstance(self.controller, FeedbackController)  # estimated only where asked for
        return simulate(
            self.scene, self.controller, duration=self.duration, sample=self.sample,
            initial=self.initial, record=(), progress=progress,
            **{**({"estimate": True} if closed else {}), **settings},
        )  # fmt: skip

"""What a case simulates: scene, start, duration, by any method."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, cast

from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.simulation.run import simulate

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene
    from hexapod_pin.validation.solver_setting import SolverSetting


@dataclass(frozen=True, eq=False)
class CaseRun:
    """What is simulated.

    Attributes:
        scene: robot, ground, contact, servos.
        start: state at t = 0, or a checkpoint to go on from.
        duration: simulated time [s], a whole number of samples.
        sample: time between samples [s]; None: only the start and the end.
        controller: gives the joint set-points.
    """

    scene: Scene
    start: State | Checkpoint
    duration: float
    sample: float | None = None
    controller: Controller = field(default_factory=HoldPosture)

    @property
    def initial(self) -> State:
        """The state at t = 0 of a run that does not go on from a checkpoint."""
        return cast("State", self.start)

    def by(self, setting: SolverSetting) -> Trace:
        """Return the trace of this run by a method at a setting.

        Raises:
            HexapodError: the method refuses the scene, or diverges.
        """
        return simulate(
            self.scene, self.controller, duration=self.duration,
            sample=self.sample or self.duration, initial=self.start, **setting.arguments,
        )  # fmt: skip

    def lasting(self, duration: float, sample: float | None = None) -> CaseRun:
        """Return the same for another duration [s], sampled otherwise [s]."""
        return replace(self, duration=duration, sample=sample)

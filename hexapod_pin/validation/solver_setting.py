"""Hard cases run under solver settings, by any method."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.simulation.case import simulate
from hexapod_pin.simulation.methods import METHODS

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


KEPT = ", error kept"
"""Suffix of the name of a method whose runs are repeated until their error is small enough."""


@dataclass(frozen=True)
class SolverSetting:
    """One of our methods with its accuracy [m, rad] or its step [s].

    Attributes:
        method: its name.
        value: the accuracy or step.
        kept: of an adaptive method, whether the error of the whole run is controlled, the default
            of `simulate`; False: a single run, each step of which meets the accuracy.
    """

    method: str
    value: float
    kept: bool = False

    @property
    def adaptive(self) -> bool:
        """Whether `value` is an accuracy."""
        return METHODS[self.method].adaptive

    @property
    def arguments(self) -> dict[str, Any]:
        """What `simulate` is given."""
        if self.adaptive:
            own: dict[str, Any] = {"accuracy": self.value, "estimate": self.kept}
        else:
            own = {"step": self.value}
        return {"method": self.method, "allow": True, **own}

    @property
    def name(self) -> str:
        """The method, and whether the error of the whole run is controlled."""
        return f"{self.method}{KEPT}" if self.kept else self.method

    @property
    def text(self) -> str:
        """The setting without the method."""
        return setting_text("accuracy" if self.adaptive else "step", self.value)

    def __str__(self) -> str:
        """Return method and setting."""
        return f"{self.name}, {self.text}"


def setting_text(kind: str, value: float) -> str:
    """Return "step 0.25 ms" or "accuracy 1e-04"."""
    return f"step {value * 1e3:g} ms" if kind == "step" else f"accuracy {value:.0e}"


def method_names(names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the requested methods, or all.

    Raises:
        UnknownNameError: there is no such method.
    """
    for name in names or ():
        if name not in METHODS:
            raise UnknownNameError("method", name, list(METHODS))
    return tuple(METHODS) if names is None else tuple(names)


def divides(part: float, whole: float) -> bool:
    """Tell whether a whole number of parts makes the whole, to 1e-9 of it."""
    count = round(whole / part)
    return count >= 1 and math.isclose(count * part, whole, rel_tol=1e-9)


DOP853 = SolverSetting("dop853", 1e-12)
NDF = SolverSetting("ndf", 1e-12)
EXTRAPOLATED_EULER = SolverSetting("extrapolated-euler", 1e-8)
DEFAULT = SolverSetting("extrapolated-euler", 1e-4)
"""What `simulate` takes where none is given and a run cannot carry its error along."""

IMPLICIT_1MS = SolverSetting("implicit-euler", 1e-3)
ROBUST_1MS = SolverSetting("robust", 1e-3)
"""Takes bodies with three-joint legs only."""


def rk4(step: float) -> SolverSetting:
    """Return rk4 at a step [s]."""
    return SolverSetting("rk4", step)


TIGHT = (DOP853, NDF)
"""Where a case needs more than extrapolated-euler promises."""

REFERENCE = (DOP853, NDF, EXTRAPOLATED_EULER)
"""Every adaptive method at its tightest."""


# What a case simulates: scene, start, duration, by any method.


@dataclass(frozen=True, eq=False)
class CaseRun:
    """What is simulated.

    Attributes:
        scene: robot, ground, contact, servos.
        start: state at t = 0, or a checkpoint to continue from.
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
        """The state at t = 0 of a run that does not continue from a checkpoint."""
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

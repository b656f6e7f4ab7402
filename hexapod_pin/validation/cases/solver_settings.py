"""How the hard cases are integrated: each method at the setting that a case about truth needs."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.errors import HexapodError
from hexapod_pin.simulation.run import simulate
from hexapod_pin.validation.cases.case_result import HardRow

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene

EXTRAPOLATED_EULER = Setting("extrapolated-euler", 1e-8)
NDF = Setting("ndf", 1e-12)
DOP853 = Setting("dop853", 1e-12)
TRUTH = (DOP853, NDF, EXTRAPOLATED_EULER)
"""dop853 and ndf at their tightest, the default method at 1e-8; a quick run takes the first."""

TIGHT = ("dop853", "ndf", "rk4", "implicit-euler", "robust")
"""All but extrapolated-euler: where a case asks for more than its accuracy promises."""

HIGH_ORDER = tuple(method for method in TIGHT if method != "ndf")
"""Without ndf too: where a case asks for more digits over a long run than order 5 keeps."""

SMALL_STEPS = Setting("rk4", 2e-5)

MILLISECOND = (Setting("implicit-euler", 1e-3),)

LEGGED = (*MILLISECOND, Setting("robust", 1e-3))
"""Fixed steps for robots; "robust" takes bodies with three-joint legs only."""


@dataclass(frozen=True, eq=False)
class Run:
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

    def by(self, way: Setting) -> Trace:
        """Return the trace of this run by a method at a setting.

        Raises:
            HexapodError: the method refuses the scene, or diverges.
        """
        return simulate(
            self.scene, self.controller, duration=self.duration,
            sample=self.sample or self.duration, initial=self.start, **way.arguments,
        )  # fmt: skip


def ways(quick: bool, choice: Sequence[Setting] = TRUTH) -> Iterator[Setting]:
    """Yield the settings to run, the first alone when quick."""
    yield from choice[:1] if quick else choice


@dataclass(frozen=True)
class Wanted:
    """A number of a case, and how near a run must come to it.

    Attributes:
        what: the number, with its parameters.
        error: how near it came.
        tolerance: how near it must.
        unit: of both; "" for relative.
        note: see `HardRow`.
        required: see `HardRow`.
    """

    what: str
    error: float
    tolerance: float
    unit: str = ""
    note: str = ""
    required: bool = True


def measured(
    case: str, what: str, way: Setting, look: Callable[[Setting], Iterable[Wanted]],
    *, required: Collection[str] | None = None,
) -> Iterator[HardRow]:  # fmt: skip
    """Yield the rows of what `look` finds with one method; one that says so where it fails.

    Args:
        case: id of the hard case.
        what: names a run that fails.
        way: method and setting.
        look: runs and compares.
        required: methods that must hold the tolerance, the others are shown; None: all.
    """
    must = required is None or way.method in required
    try:
        for row in look(way):
            yield HardRow(
                case, row.what, str(way), row.error, row.tolerance, row.unit, row.note,
                required=must and row.required,
            )  # fmt: skip
    except HexapodError as error:
        yield HardRow(case, what, str(way), math.inf, 0.0, note=str(error), required=must)

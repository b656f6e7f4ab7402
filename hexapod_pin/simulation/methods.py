"""The integration methods by name, and the accuracies and steps that each takes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hexapod_pin.drive.drive_law import has_dry_friction
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.simulation.resolution import JUMP, LEVELS_PER_DECADE, MOST_LEVELS

if TYPE_CHECKING:
    from hexapod_pin.results.error_estimate import ErrorEstimate
    from hexapod_pin.scene.scene import Scene

DEFAULT_ACCURACY = 1e-4
"""[m and rad]"""

LOOSEST_TOLERANCE = {"extrapolated-euler": 1e-3, "ndf": 2e-6, "dop853": 1e-3}
"""Of one step [m and rad], of runs that are compared: looser ones differ in what they miss."""

LOOSEST_CARRIED_TOLERANCE: dict[str, float] = {"extrapolated-euler": 10.0**-2.5, "ndf": 1e-5}
"""The same of runs that carry their error along; looser ones were not tried on random scenes."""

TORQUE_TOLERANCE: dict[str, float] = {"ndf": 10.0**-3.5}
"""The same over the share of the largest torque that torques may be off by, where that is requested
[m and rad]: 3 of 45 random walks needed a second run then."""

START_RATIO = 10.0
"""Tolerance of level 0 over the accuracy: [-]."""
LEAST_TOLERANCE = {"extrapolated-euler": 1e-10, "ndf": 1e-13, "dop853": 1e-13}
"""Of one step [m and rad]: below it round-off takes over, or steps become too many."""

SECOND_LEVEL = {"extrapolated-euler": 4, "ndf": 6, "dop853": 4}
"""Level of the run that is compared with that of level 0 first. Steps of ndf are often limited by
its history: with a tenth of the tolerance the error may stay the same and would not be seen."""

HELD_LEVELS = {"extrapolated-euler": 2, "ndf": 0, "dop853": 0}
"""How many levels finer the second run is where `LOOSEST_TOLERANCE` limits level 0 to a tenth of
what the accuracy allows: two such runs may both be wrong about which foot slides or touches."""

CARRIED_RATIO: dict[str, tuple[float, float]] = {
    "extrapolated-euler": (10.0**-0.5, 1.0),
    "ndf": (0.3, 0.3),
}
"""Of the methods whose runs carry their error along: tolerance of the first over the accuracy, at
most [-]; and where a run coarser by `JUMP` levels could be compared with it: then both cost what
two runs that know nothing of their errors do."""

SENSITIVE_LEVELS = {"extrapolated-euler": 4, "ndf": 0, "dop853": 4}
"""The same for a `sensitive` scene: down to a hundredth of the tolerance."""

ORDER = {"extrapolated-euler": 3}
"""Of methods whose steps end at samples where runs are compared: there the error follows the steps,
not the tolerance."""

DEFAULT_STEP = 1e-3
"""[s]"""

DEFAULT_METHOD = "ndf"
"""Of planned runs in a scene in which they carry their error along; see `Scene.carries_errors`."""

FALLBACK_METHOD = "extrapolated-euler"
"""Where no method is named and a run cannot carry its error along."""

DEFAULT_TORQUE_ACCURACY = "1 %"
"""Of the largest torque, in runs that carry their error along, beside `DEFAULT_ACCURACY`, where no
accuracy is given."""

DEFAULT_TORQUE_METHOD = "ndf"
"""Where an accuracy of torques is given alone: its torques are more accurate than its positions."""

DEFAULT_FIXED_METHOD = "implicit-euler"
"""Where a step is given and no method."""


@dataclass(frozen=True)
class Method(Immutable):
    """An integration method.

    Attributes:
        name: value of `simulate(method=...)`.
        adaptive: True: it meets a given accuracy; False: fixed steps.
        tightest: least accuracy that it takes [m and rad]; 0 for fixed steps.
        loosest: largest accuracy that it takes [m and rad]; 0 for fixed steps.
        about: a description in one line.
    """

    name: str
    adaptive: bool
    tightest: float
    loosest: float
    about: str


METHODS = {
    method.name: method
    for method in (
        Method(
            "extrapolated-euler", True, 1e-8, 0.1, "linearly implicit Euler, order 3, for feedback"
        ),
        Method("ndf", True, 1e-12, 0.1, "NDF 1-5; a run knows its own error; the default"),
        Method("dop853", True, 1e-12, 1e-2, "explicit, order 8, no Jacobian: independent truth"),
        Method("robust", False, 0.0, 0.0, "nested Newton contact solve; never blows up"),
        Method("implicit-euler", False, 0.0, 0.0, "linearly implicit, order 1, one solve a step"),
        Method("rk4", False, 0.0, 0.0, "explicit, order 4, steps below the contact's time scale"),
    )
}
"""The public methods."""

SHORT_NAMES = {"x3": "extrapolated-euler"}
"""Short names that are taken too."""

INTERNAL = {
    "robust-reference": Method(
        "robust-reference", False, 0.0, 0.0, "robust without its flat accelerator, for tests"
    )
}
"""Methods that exist to be compared with."""


@dataclass(frozen=True)
class MethodSettings:
    """A method with the one number it takes.

    Attributes:
        method: the method.
        accuracy: largest error in positions [m and rad]; 0 for fixed steps.
        step: integration step [s]; 0 for an adaptive method.
        torque_accuracy: largest error of torques [N m]; 0: not requested.
        torque_share: the same over the largest torque [-]; 0: not requested.
        positions: whether `accuracy` was requested, too.
        refinement: level of resolution of an adaptive method whose global error is controlled:
            tolerances fall to a tenth with four levels. None: `accuracy` is the tolerance of one
            step, and the error of the whole run is unknown.
        sensitive: whether small errors may change the motion of the scene altogether.
        carries_error: whether runs whose global error is controlled carry it along.
        slow_decay: whether errors may fall more slowly than tolerances: ticks of a controller, or
            joints that stick and slip, end steps and begin them anew.
    """

    method: Method
    accuracy: float
    step: float
    torque_accuracy: float = 0.0
    torque_share: float = 0.0
    positions: bool = True
    refinement: int | None = None
    sensitive: bool = False
    carries_error: bool = False
    slow_decay: bool = False

    def for_scene(self, scene: Scene, *, feedback: bool = False) -> MethodSettings:
        """Return the settings for a scene, which says how its errors can be found.

        `feedback`: a controller follows what it measures; what it makes of an error is not known.
        """
        carries = self.method.name in CARRIED_RATIO and scene.carries_errors and not feedback
        slow = feedback or has_dry_friction(scene.robot, scene.servos)
        return replace(self, sensitive=scene.sensitive, carries_error=carries, slow_decay=slow)

    @property
    def tolerance(self) -> float:
        """Tolerance of one step [m and rad]; 0 for fixed steps."""
        if not self.method.adaptive:
            return 0.0
        if self.refinement is None:
            return min(self._loosest, self.accuracy)
        return min(self._loosest, START_RATIO * self.accuracy) / self.tolerance_ratio

    @property
    def _loosest(self) -> float:
        """Loosest tolerance of one step [m and rad]."""
        name = self.method.name
        if not self.carries_error:
            return LOOSEST_TOLERANCE[name]
        of_position = max(LOOSEST_TOLERANCE[name], CARRIED_RATIO[name][0] * self.accuracy)
        of_torque = TORQUE_TOLERANCE.get(name, math.inf) * (self.torque_share or math.inf)
        return min(LOOSEST_CARRIED_TOLERANCE[name], of_position, of_torque)

    @property
    def resolved_accuracy(self) -> float:
        """The accuracy below which runs get finer [m and rad]: at looser ones they are the same."""
        share = CARRIED_RATIO[self.method.name][0] if self.carries_error else START_RATIO
        return min(self.accuracy, self._loosest / share)

    @property
    def tolerance_ratio(self) -> float:
        """Tolerance at level 0 over that of this level, at least 1 [-]."""
        return float(10.0 ** ((self.refinement or 0) / LEVELS_PER_DECADE))

    @property
    def first_levels(self) -> tuple[int, int]:
        """Levels of the first two runs of an adaptive method.

        A run that carries its error along needs no second one where that is small enough; if it
        needs one, a coarser one will do where there is any.
        """
        name = self.method.name
        if self.carries_error:
            usual, coarser_known = CARRIED_RATIO[name]
            first = min(self._level_of(usual), max(JUMP, self._level_of(coarser_known)))
            apart = SECOND_LEVEL[name]
            if first < JUMP:
                return first, max(first + apart, self._second_level)
            return first, max(0, first - apart)
        return 0, self._second_level

    def _level_of(self, ratio: float) -> int:
        """Return the coarsest level whose tolerance is at most this share of the accuracy."""
        decades = math.log10(replace(self, refinement=0).tolerance / (ratio * self.accuracy))
        return max(0, math.ceil(LEVELS_PER_DECADE * decades - 1e-9))

    @property
    def _second_level(self) -> int:
        """Level of the run that is compared with that of level 0 first."""
        name = self.method.name
        decades = math.log10(START_RATIO * self.accuracy / self._loosest)
        further = math.ceil(HELD_LEVELS[name] * min(1.0, max(0.0, decades - 1e-9)))
        if self.sensitive:
            further = max(further, SENSITIVE_LEVELS[name])
        return SECOND_LEVEL[name] + further

    @property
    def finest_level(self) -> int:
        """The finest level: where round-off takes over."""
        coarsest = replace(self, refinement=0).tolerance
        decades = math.log10(coarsest / LEAST_TOLERANCE[self.method.name])
        return max(
            *self.first_levels, min(MOST_LEVELS, math.floor(LEVELS_PER_DECADE * decades + 1e-9))
        )

    def error_ratio(self, error: ErrorEstimate, largest_torque: float) -> float:
        """Return the largest estimated error over the accuracy requested [-].

        Raises:
            ParameterError: a torque accuracy without recorded torques.
        """
        over = float(error.position.max()) / self.accuracy if self.positions else 0.0
        allowed = self.torque_accuracy or self.torque_share * largest_torque
        if not allowed:
            return over
        if error.torque is None:
            raise ParameterError("record", "without torque", "with torque, for `torque_accuracy`")
        return max(over, float(error.torque.max()) / allowed)

    @property
    def torque_request(self) -> dict[str, float]:
        """The torque accuracy requested, as data; empty where there is none."""
        given = {"torque_accuracy": self.torque_accuracy, "torque_share": self.torque_share}
        return {name: value for name, value in given.items() if value}


def resolve_method(
    method: str | None,
    accuracy: float | None,
    step: float | None,
    torque_accuracy: float | str | None = None,
) -> MethodSettings:
    """Return the method of the settings given.

    Nothing given: "extrapolated-euler" at 1e-4. An accuracy alone: the same at that. An accuracy of
    torques alone: "ndf". A step alone: "implicit-euler". A `Case` knows its scene, and names "ndf"
    where a run can carry its error along.

    Raises:
        ParameterError: unknown method; accuracy or step out of range, or not of this method.
    """
    only_torque = torque_accuracy is not None and accuracy is None and step is None
    usual = FALLBACK_METHOD if step is None else DEFAULT_FIXED_METHOD
    name = method or (DEFAULT_TORQUE_METHOD if only_torque else usual)
    known = {**METHODS, **INTERNAL}
    found = known.get(SHORT_NAMES.get(name, name))
    if found is None:
        raise ParameterError("method", name, f"one of {', '.join(METHODS)}")
    if found.adaptive:
        settings = _adaptive(found, accuracy, step)
        if torque_accuracy is None:
            return settings
        size, share = _torque_accuracy(torque_accuracy)
        return replace(
            settings, torque_accuracy=size, torque_share=share, positions=accuracy is not None
        )
    if torque_accuracy is not None:
        raise ParameterError(
            "torque_accuracy", torque_accuracy, f"left out with method {name!r}", "It takes a step."
        )
    if accuracy is not None:
        raise ParameterError(
            "accuracy", accuracy, f"left out with method {name!r}", "It takes a step [s]."
        )
    size = DEFAULT_STEP if step is None else step
    if not (math.isfinite(size) and size > 0.0):
        raise ParameterError("step", size, "positive and finite [s]")
    return MethodSettings(found, 0.0, float(size))


def _torque_accuracy(given: float | str) -> tuple[float, float]:
    """Return an accuracy of torques as a size [N m] and as a share of the largest; one is 0.

    Raises:
        ParameterError: neither a number above 0 nor a percentage below 100 %.
    """
    is_share = isinstance(given, str)
    text = given.strip().removesuffix("%") if isinstance(given, str) else given
    try:
        number = float(text) / (100.0 if is_share else 1.0)
    except (TypeError, ValueError):
        number = float("nan")
    marked = not isinstance(given, str) or given.strip().endswith("%")
    if not (math.isfinite(number) and number > 0.0 and marked and not (is_share and number >= 1.0)):
        raise ParameterError("torque_accuracy", given, 'above 0 N m, or a share such as "1 %"')
    return (0.0, number) if is_share else (number, 0.0)


def _adaptive(method: Method, accuracy: float | None, step: float | None) -> MethodSettings:
    if step is not None:
        raise ParameterError(
            "step", step, f"left out with method {method.name!r}", "It takes an accuracy."
        )
    wanted = min(DEFAULT_ACCURACY, method.loosest) if accuracy is None else accuracy
    if not method.tightest <= wanted <= method.loosest:
        raise ParameterError(
            "accuracy",
            wanted,
            f"{method.tightest:g} to {method.loosest:g} m and rad with method {method.name!r}",
        )
    return MethodSettings(method, float(wanted), 0.0)


def check_supported(method_settings: MethodSettings, scene: Scene) -> None:
    """Refuse a method that cannot do a scene.

    Raises:
        ParameterError: names the part of the scene and the remedy.
    """
    friction = scene.contact.friction
    if (
        method_settings.method.adaptive
        and friction.kind == "stick-slip"
        and friction.damping <= 0.0
    ):
        raise ParameterError(
            "StickSlip.damping",
            friction.damping,
            f"above 0 N s/m with method {method_settings.method.name!r}",
            "Without it a sliding spring has no rate of its own. Or take a fixed-step method.",
        )

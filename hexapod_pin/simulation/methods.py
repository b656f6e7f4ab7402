"""The integration methods by name, and what each may be asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.simulation.scene import Scene

DEFAULT_ACCURACY = 1e-4
"""[m and rad]"""

DEFAULT_STEP = 1e-3
"""[s]"""

DEFAULT_METHOD = "extrapolated-euler"
DEFAULT_FIXED_METHOD = "implicit-euler"
"""Where a step is given and no method."""


@dataclass(frozen=True)
class Method:
    """One way to integrate.

    Attributes:
        name: what `simulate(method=...)` takes.
        adaptive: True: keeps a stated accuracy; False: fixed steps.
        tightest: least accuracy it may be asked for [m and rad]; 0 for fixed steps.
        loosest: largest accuracy it may be asked for [m and rad]; 0 for fixed steps.
        about: one line for people.
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
            "extrapolated-euler", True, 1e-8, 0.1, "linearly implicit Euler, order 3; the default"
        ),
        Method("ndf", True, 1e-12, 1e-5, "NDF 1-5, for tight accuracy and reference runs"),
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
        accuracy: error in positions it shall keep [m and rad]; 0 for fixed steps.
        step: integration step [s]; 0 for an adaptive method.
    """

    method: Method
    accuracy: float
    step: float


def resolve_method(
    method: str | None, accuracy: float | None, step: float | None
) -> MethodSettings:
    """Return the method meant by what the user gave.

    Nothing given: "extrapolated-euler" at 1e-4. An accuracy alone: the same at that. A step alone:
    "implicit-euler".

    Raises:
        ParameterError: unknown method; accuracy or step out of range, or not of this method.
    """
    name = method or (DEFAULT_METHOD if step is None else DEFAULT_FIXED_METHOD)
    known = {**METHODS, **INTERNAL}
    found = known.get(SHORT_NAMES.get(name, name))
    if found is None:
        raise ParameterError("method", name, f"one of {', '.join(METHODS)}")
    if found.adaptive:
        return _adaptive(found, accuracy, step)
    if accuracy is not None:
        raise ParameterError(
            "accuracy", accuracy, f"left out with method {name!r}", "It takes a step [s]."
        )
    size = DEFAULT_STEP if step is None else step
    if not (math.isfinite(size) and size > 0.0):
        raise ParameterError("step", size, "positive and finite [s]")
    return MethodSettings(found, 0.0, float(size))


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
            "Looser than 1e-5 its history misleads it across stick and slip: "
            "take extrapolated-euler."
            if method.name == "ndf" and wanted > method.loosest
            else "",
        )
    return MethodSettings(method, float(wanted), 0.0)


def check_supported(choice: MethodSettings, scene: Scene) -> None:
    """Refuse a method that cannot do a scene.

    Raises:
        ParameterError: names the part of the scene and the way out.
    """
    friction = scene.contact.friction
    if choice.method.adaptive and friction.kind == "stick-slip" and friction.damping <= 0.0:
        raise ParameterError(
            "StickSlip.damping",
            friction.damping,
            f"above 0 N s/m with method {choice.method.name!r}",
            "Without it a sliding spring has no rate of its own. Or take a fixed-step method.",
        )

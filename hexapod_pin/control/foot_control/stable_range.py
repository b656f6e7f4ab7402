"""Ranges of the gains of foot control in which a standing robot stands still."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hexapod_pin.control.foot_control.loop_gains import effective_delay, slip_gains, weight_of
from hexapod_pin.control.foot_control.stance_loop import spectral_radii
from hexapod_pin.errors import ParameterError, UnknownNameError

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.controller import FootControl

SPAN = 1e3
"""Borders are looked for within this factor of a value."""

COARSE = 2.0
"""Factor between two values that are tried in search of a border."""

FINE = 2e-3
"""Share of a border to which it is found."""

PARAMETERS = {
    "slip.kp": "m/N or 1", "slip.ki": "m/(N s) or 1/s", "slip.kd": "m s/N or s",
    "slip.bandwidth": "Hz", "suspension.stiffness": "N/m", "suspension.frequency": "Hz",
    "suspension.damping": "-",
}  # fmt: skip
"""Parameters whose stable range can be asked for, and their units."""


def parameter_value(control: FootControl, scene: Any, parameter: str) -> float:
    """Return what a parameter such as "slip.ki" is, given or derived.

    Raises:
        UnknownNameError: no such parameter.
        ParameterError: the controller does not have the part.
    """
    if parameter not in PARAMETERS:
        raise UnknownNameError("parameter", parameter, list(PARAMETERS))
    name, _, field_name = parameter.partition(".")
    part = getattr(control, name)
    if part is None:
        raise ParameterError(f"FootControl.{name}", None, f"given for a range of {parameter}")
    value = getattr(part, field_name)
    if name == "suspension" and value is None:
        found = part.resolved(weight_of(scene), effective_delay(control))
        return float(dict(zip(("stiffness", "frequency"), found, strict=True))[field_name])
    if value is None:
        value = dict(zip(("kp", "ki", "kd"), slip_gains(control, scene), strict=True))[field_name]
    return float(value)


def with_parameter(control: FootControl, parameter: str, value: float) -> FootControl:
    """Return a controller with another value of a parameter such as "slip.ki"."""
    name, _, field_name = parameter.partition(".")
    part = getattr(control, name)
    return replace(control, **{name: type(part)(**{**part.model_dump(), field_name: value})})


def stable_range(
    control: FootControl,
    scene: Any,
    parameter: str,
    feet: Sequence[str] | None = None,
    touch_speed: float | None = None,
    drift_time: float = math.inf,
    span: float = SPAN,
) -> tuple[float, float]:
    """Return the range of a parameter in which the loop of a standing robot is stable.

    Of several ranges the one around the controller's own value, or the nearest to it.

    Args:
        control: the controller.
        scene: what it controls.
        parameter: a key of `PARAMETERS`.
        feet: as of `StanceModel.of`.
        touch_speed: as of `spectral_radius` [m/s].
        drift_time: as of `LinearLoop.radius` [s].
        span: values up to this factor away are looked at.

    Returns:
        Lower and upper end, found to 0.2 %; 0 and inf where there is none in the span.
        (nan, nan): no value in it is stable.

    Raises:
        UnknownNameError: no such parameter.
        ParameterError: the controller does not have the part.
    """

    def stable(value: float) -> bool:
        changed = with_parameter(control, parameter, value)
        return all(r < 1.0 for r in spectral_radii(changed, scene, feet, touch_speed, drift_time))

    own = parameter_value(control, scene, parameter)
    centre = own if own > 0.0 else _unit(control, scene, parameter)
    count = math.ceil(math.log(span, COARSE))
    tried = [centre * COARSE**k for k in range(-count, count + 1)]
    first = count if own > 0.0 else 0
    order = sorted(range(len(tried)), key=lambda k: abs(k - first))
    start = next((k for k in order if stable(tried[k])), None)
    if start is None:
        return math.nan, math.nan
    low = _border(stable, tried[start::-1])
    high = _border(stable, tried[start:])
    return (0.0 if low is None else low), (math.inf if high is None else high)


def _border(stable: Callable[[float], bool], values: Sequence[float]) -> float | None:
    """Return where stability ends on the way through values, the first a stable one; or None."""
    end = next((k for k in range(1, len(values)) if not stable(values[k])), None)
    if end is None:
        return None
    inside, outside = values[end - 1], values[end]
    while abs(math.log(outside / inside)) > FINE:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if stable(middle) else (inside, middle)
    return inside


def _unit(control: FootControl, scene: Any, parameter: str) -> float:
    """Return a scale of a gain that is 0: with it the PID's parts are alike at the bandwidth."""
    assert control.slip is not None
    derived = replace(control, slip=control.slip.model_copy(update={"ki": None}))
    rate = 2.0 * math.pi * control.slip.bandwidth
    integral = slip_gains(derived, scene)[1]
    return integral / rate if parameter == "slip.kp" else integral / rate**2

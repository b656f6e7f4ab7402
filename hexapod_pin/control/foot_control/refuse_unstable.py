"""The refusal of gains with which a standing robot would shake."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hexapod_pin.control.foot_control.stable_range import (
    PARAMETERS,
    parameter_value,
    stable_range,
)
from hexapod_pin.control.foot_control.stance_loop import (
    kept_loops,
    once,
    plant_key,
    spectral_radius,
)
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.controller import FootControl

REFUSAL_SPAN = 100.0
"""Factor around a value in which a refusal looks for stable ones."""


def refuse_unstable(control: FootControl, scene: Any) -> None:
    """Refuse a controller with which a standing robot would shake; a verdict is kept.

    What drifts without swinging, slower than by e in a stance, is let pass: corrections are taken
    back at lift-off.

    Raises:
        ParameterError: names the parameter that is nearest to a stable value, and its range.
    """
    if not any((control.slip, control.suspension, control.levelling)):
        return
    settings = {
        key: value for key, value in control.to_dict().items() if key not in ("walk", "gait")
    }
    drift_time = control.gait.duty * control.gait.cycle_time
    key = f"{plant_key(control, scene)} {json.dumps(settings, default=str)} {drift_time!r}"

    def make() -> ParameterError | None:
        radius = spectral_radius(control, scene, drift_time=drift_time)
        return None if radius < 1.0 else _refusal(control, scene, radius, drift_time)

    error = once(kept_loops(scene.robot).verdicts, key, make)
    if error is not None:
        raise error.with_traceback(None)


def _refusal(control: FootControl, scene: Any, radius: float, drift_time: float) -> ParameterError:
    """Return the error that names what is nearest to a stable value."""
    ranges: dict[str, tuple[float, float]] = {}
    for name in _suspects(control, scene, drift_time):
        ends = stable_range(control, scene, name, drift_time=drift_time, span=REFUSAL_SPAN)
        if not math.isnan(ends[0]):
            ranges[name] = ends
    time = control.period / math.log(radius)
    where = (
        f"Standing, with ticks of {1e3 * control.period:g} ms and a delay of "
        f"{1e3 * control.loop_delay:g} ms, {scene.robot.name} would shake: "
        f"its motion grows by e in {time:.2g} s."
    )
    if not ranges:
        return ParameterError(
            "FootControl.delay",
            control.loop_delay,
            "shorter with these gains",
            f"{where.capitalize()}.",
        )
    values = {name: parameter_value(control, scene, name) for name in ranges}
    best = min(ranges, key=lambda name: _distance(values[name], ranges[name]))
    others = [
        f"{name} {_text(*ranges[name], PARAMETERS[name])}"
        for name in ranges
        if name != best and _distance(values[name], ranges[name]) > 0.0
    ]
    hint = f"{where} " + (
        f"Or one of: {'; '.join(others)}; or a shorter delay." if others else "Or a shorter delay."
    )
    return ParameterError(best, values[best], _text(*ranges[best], PARAMETERS[best]), hint)


def _suspects(control: FootControl, scene: Any, drift_time: float) -> list[str]:
    """Return the parameters of the parts without which the loop is stable; else all."""
    parts = [name for name in ("slip", "suspension") if getattr(control, name) is not None]
    without = {"slip": replace(control, slip=None), "suspension": replace(control, suspension=None)}
    guilty = [
        name for name in parts if spectral_radius(without[name], scene, drift_time=drift_time) < 1.0
    ]
    own = [name.partition(".") for name in PARAMETERS]
    return [
        f"{part}.{name}"
        for part, _, name in own
        if part in (guilty or parts) and (part != "slip" or _is_given(control, name))
    ]


def _is_given(control: FootControl, own: str) -> bool:
    """Whether a gain of the slip correction was given, or the bandwidth that it follows from."""
    slip = control.slip
    assert slip is not None
    return slip.ki is None if own == "bandwidth" else getattr(slip, own) is not None


def _distance(value: float, ends: tuple[float, float]) -> float:
    """Return by which factor a value is outside of a range, as a logarithm."""
    low, high = ends
    if low <= value <= high:
        return 0.0
    return abs(math.log(value / (low if value < low else high)))


def _text(low: float, high: float, unit: str) -> str:
    if math.isinf(high):
        return f"above {low:.3g} {unit}"
    return f"below {high:.3g} {unit}" if low == 0.0 else f"from {low:.3g} to {high:.3g} {unit}"

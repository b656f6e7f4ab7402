"""Foot control of a standing robot is a closed loop; its small motions grow or decay.

Gains have stable ranges, and unstable gains are refused.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar, cast

from hexapod_pin.control.foot_control.law import (
    effective_delay,
    law_settings,
    native_law,
    slip_bandwidth,
    slip_gains,
    weight_of,
)
from hexapod_pin.control.foot_control.leg_model import known_scene, leg_chains, once
from hexapod_pin.control.foot_control.linear_law import LinearLaw, LinearLoop
from hexapod_pin.control.foot_control.stance_model import StanceModel
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import Restitution
from hexapod_pin.robot.robot import robot_content

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.parameters import ControlParts
    from hexapod_pin.native import LegChain
    from hexapod_pin.robot.robot import Robot


Control = TypeVar("Control", bound="ControlParts")

TOUCH_SPEEDS = (0.0, 0.1)
"""Of feet put down gently and in a walk [m/s] (*assumed*): contacts with a coefficient of
restitution are damped as by their touch speed, and the loop is to be stable with both."""

FAR = 1e9
"""Limits of the linear law: it has none [m]."""

WITHIN = 0.5
"""Share of their targets that feet carry about which the law is linear whose slip correction
leaves all between none and the targets [-]: from there it corrects across that alone."""

KEPT_ROBOTS = 16
"""How many robots' loops are cached."""


@dataclass
class KeptLoops:
    """Cached results of a robot.

    Attributes:
        loops: by servos, contact, times, feet.
        chains: the legs without dry friction, by servos.
        verdicts: errors of controllers, or None, by all of their settings.
        gains: integral gains of slip corrections that follow from the loop, or None, likewise.
    """

    loops: OrderedDict[str, LinearLoop] = field(default_factory=OrderedDict)
    chains: OrderedDict[str, list[LegChain]] = field(default_factory=OrderedDict)
    verdicts: OrderedDict[str, ParameterError | None] = field(default_factory=OrderedDict)
    gains: OrderedDict[str, float | None] = field(default_factory=OrderedDict)


def kept_loops(robot: Robot) -> KeptLoops:
    """Return the cache of a robot, which equal robots share."""
    return _loops_of(robot_content(robot))


@lru_cache(maxsize=KEPT_ROBOTS)
def _loops_of(content: bytes) -> KeptLoops:
    return KeptLoops()


def plant_key(control: ControlParts, scene: Any) -> str:
    """Return a text that differs where the loop of a robot differs, its controller's law aside."""
    times = f"{control.period!r} {control.loop_delay!r} {scene.gravity}"
    return f"{times} {scene.servos.model_dump_json()} {scene.contact.model_dump_json()}"


def stance_loop(
    control: ControlParts,
    scene: Any,
    feet: Sequence[str] | None = None,
    touch_speed: float = 0.0,
) -> LinearLoop:
    """Return the standing robot of a scene between the ticks of a controller.

    `scene`, `feet` and `touch_speed` [m/s] are as of `StanceModel.of`.
    """
    key = f"{plant_key(control, scene)} {feet} {touch_speed!r}"

    def make() -> LinearLoop:
        stance = StanceModel.of(scene, feet, touch_speed)
        return LinearLoop.of(stance, control.period, control.loop_delay)

    return once(kept_loops(scene.robot).loops, key, make)


def linear_law(control: ControlParts, scene: Any, stance: StanceModel) -> LinearLaw:
    """Return a controller's law about a stance, limits and dry friction aside."""
    settings = law_settings(control, scene)
    slip, suspension = settings.slip, settings.suspension
    slip.limit = suspension.limit = FAR
    settings.slip, settings.suspension = slip, suspension
    chains = once(
        kept_loops(scene.robot).chains,
        scene.servos.model_dump_json(),
        lambda: leg_chains(scene, dry_friction=False),
    )
    law, targets = native_law(scene, settings, chains), control.force_targets
    between = targets is not None and targets.deviation == "segment"
    share = WITHIN if between else 1.0
    return LinearLaw.of(law, scene, stance, control.period, share)


def spectral_radius(
    control: ControlParts,
    scene: Any,
    feet: Sequence[str] | None = None,
    touch_speed: float | None = None,
    drift_time: float = math.inf,
) -> float:
    """Return the factor by which a small motion of a standing robot grows per tick, at most.

    Args:
        control: the controller.
        scene: what it controls.
        feet: as of `StanceModel.of`.
        touch_speed: as of `StanceModel.of` [m/s]; None: the worse of `TOUCH_SPEEDS`.
        drift_time: as of `LinearLoop.radius` [s].

    Returns:
        Below 1 where the loop is stable [-].
    """
    return max(spectral_radii(control, scene, feet, touch_speed, drift_time))


def spectral_radii(
    control: ControlParts,
    scene: Any,
    feet: Sequence[str] | None,
    touch_speed: float | None,
    drift_time: float,
) -> Iterator[float]:
    """Return the spectral radius with each touch speed that matters, as of `spectral_radius`."""
    speeds: Sequence[float] = TOUCH_SPEEDS if touch_speed is None else (touch_speed,)
    if not isinstance(scene.contact.normal, Restitution):
        speeds = speeds[:1]
    law: LinearLaw | None = None
    scene = known_scene(scene)
    for speed in speeds:
        loop = stance_loop(control, scene, feet, speed)
        law = law or linear_law(control, scene, loop.stance)
        yield loop.radius(law, drift_time)


# Ranges of the gains of foot control in which a standing robot stands still.

SPAN = 1e3
"""Borders are searched within this factor of a value."""

COARSE = 2.0
"""Factor between two values of the search for a border."""

FINE = 2e-3
"""Relative error of a border."""

PARAMETERS = {
    "slip.kp": "m/N or 1", "slip.ki": "m/(N s) or 1/s", "slip.kd": "m s/N or s",
    "slip.bandwidth": "Hz", "suspension.stiffness": "N/m", "suspension.frequency": "Hz",
    "suspension.damping": "-",
}  # fmt: skip
"""Parameters of `stable_range`, and their units."""


def parameter_value(control: ControlParts, scene: Any, parameter: str) -> float:
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
    if field_name == "bandwidth":
        return slip_bandwidth(control)
    if value is None:
        value = dict(zip(("kp", "ki", "kd"), slip_gains(control, scene), strict=True))[field_name]
    return float(value)


def _replaced(control: Control, **changes: Any) -> Control:
    """Return a controller, which is a frozen dataclass, with other parts."""
    changed: Control = replace(cast("Any", control), **changes)
    return changed


def with_parameter(control: Control, parameter: str, value: float) -> Control:
    """Return a controller with another value of a parameter such as "slip.ki"."""
    name, _, field_name = parameter.partition(".")
    part = getattr(control, name)
    changed: Any = type(part)(**{**part.model_dump(), field_name: value})
    return _replaced(control, **{name: changed})


def stable_range(
    control: ControlParts,
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
        span: largest factor to a value that is tried.

    Returns:
        Lower and upper end, found to 0.2 %; 0 and inf where there is none in the span.
        (nan, nan): no value in it is stable.

    Raises:
        UnknownNameError: no such parameter.
        ParameterError: the controller does not have the part.
    """
    scene = known_scene(scene)

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
    """Return where stability ends along values, of which the first is stable; or None."""
    end = next((k for k in range(1, len(values)) if not stable(values[k])), None)
    if end is None:
        return None
    inside, outside = values[end - 1], values[end]
    while abs(math.log(outside / inside)) > FINE:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if stable(middle) else (inside, middle)
    return inside


def _unit(control: ControlParts, scene: Any, parameter: str) -> float:
    """Return a scale of a gain that is 0: with it the PID's parts are equal at the bandwidth."""
    assert control.slip is not None
    derived = _replaced(control, slip=control.slip.model_copy(update={"ki": None}))
    rate = 2.0 * math.pi * slip_bandwidth(control)
    integral = slip_gains(derived, scene)[1]
    return integral / rate if parameter == "slip.kp" else integral / rate**2


# The refusal of gains with which a standing robot would shake.

REFUSAL_SPAN = 100.0
"""Factor around a value in which a refusal searches for stable ones."""


def refuse_unstable(control: ControlParts, scene: Any) -> None:
    """Refuse a controller with which a standing robot would shake; the verdict is cached.

    Drift without oscillation, slower than by e in a stance, is accepted: corrections are removed at
    lift-off.

    Raises:
        ParameterError: names the parameter that is nearest to a stable value, and its range.
    """
    if not any((control.slip, control.force_targets, control.suspension, control.levelling)):
        return
    drift_time, key = _drift_time(control), _whole_key(control, scene)

    def make() -> ParameterError | None:
        radius = spectral_radius(control, scene, drift_time=drift_time)
        return None if radius < 1.0 else _refusal(control, scene, radius, drift_time)

    error = once(kept_loops(scene.robot).verdicts, key, make)
    if error is not None:
        raise error.with_traceback(None)


def _drift_time(control: ControlParts) -> float:
    """Return the duration of a stance [s]."""
    return control.gait.duty * control.gait.cycle_time


def _whole_key(control: ControlParts, scene: Any) -> str:
    """Return a text that differs where the closed loop of a robot differs."""
    settings = {
        key: value for key, value in control.to_dict().items() if key not in ("walk", "gait")
    }
    text = json.dumps(settings, default=str)
    return f"{plant_key(control, scene)} {text} {_drift_time(control)!r}"


# Gains that nobody gives follow from the loop that they are in.

GAIN_MARGIN = 2.0
"""With so many times a gain that follows from the loop, that is stable."""

HALVINGS = 8
"""How often a gain is halved at most to reach the margin."""


def with_stable_gains(control: Control, scene: Any) -> Control:
    """Return a controller whose slip correction has a gain for this robot, where none is given.

    The integral gain of its default bandwidth is halved until the loop of the standing robot is
    stable with `GAIN_MARGIN` times that. A controller with a gain or a bandwidth, or whose loop
    is unstable for another reason, is returned as it is.
    """
    slip = control.slip
    if slip is None or slip.ki is not None or slip.bandwidth is not None:
        return control

    def make() -> float | None:
        gain = slip_gains(control, scene)[1]
        for halved in range(HALVINGS + 1):
            own = gain / 2.0**halved
            tried = with_parameter(control, "slip.ki", GAIN_MARGIN * own)
            radii = spectral_radii(tried, scene, None, None, _drift_time(control))
            if all(radius < 1.0 for radius in radii):
                return own if halved else None
        return None

    gain = once(kept_loops(scene.robot).gains, _whole_key(control, scene), make)
    return control if gain is None else with_parameter(control, "slip.ki", gain)


def _refusal(control: ControlParts, scene: Any, radius: float, drift_time: float) -> ParameterError:
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


def _suspects(control: ControlParts, scene: Any, drift_time: float) -> list[str]:
    """Return the parameters of the parts without which the loop is stable; else all."""
    parts = [name for name in ("slip", "suspension") if getattr(control, name) is not None]
    without = {
        "slip": _replaced(control, slip=None),
        "suspension": _replaced(control, suspension=None),
    }
    causes = [
        name for name in parts if spectral_radius(without[name], scene, drift_time=drift_time) < 1.0
    ]
    own = [name.partition(".") for name in PARAMETERS]
    return [
        f"{part}.{name}"
        for part, _, name in own
        if part in (causes or parts) and (part != "slip" or _is_given(control, name))
    ]


def _is_given(control: ControlParts, own: str) -> bool:
    """Whether a gain of the slip correction was given, or the bandwidth that it follows from."""
    slip = control.slip
    assert slip is not None
    if own == "bandwidth":
        return slip.ki is None and slip.bandwidth is not None
    return getattr(slip, own) is not None or (own == "ki" and slip.bandwidth is None)


def _distance(value: float, ends: tuple[float, float]) -> float:
    """Return the logarithm of the factor by which a value is outside of a range."""
    low, high = ends
    if low <= value <= high:
        return 0.0
    return abs(math.log(value / (low if value < low else high)))


def _text(low: float, high: float, unit: str) -> str:
    if math.isinf(high):
        return f"above {low:.3g} {unit}"
    return f"below {high:.3g} {unit}" if low == 0.0 else f"from {low:.3g} to {high:.3g} {unit}"

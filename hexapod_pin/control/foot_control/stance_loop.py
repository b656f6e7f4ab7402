"""Foot control of a standing robot as a closed loop: how fast its small motions grow."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from hexapod_pin.control.foot_control.leg_model import leg_chains
from hexapod_pin.control.foot_control.linear_law import LinearLaw
from hexapod_pin.control.foot_control.linear_loop import LinearLoop
from hexapod_pin.control.foot_control.stance_model import StanceModel
from hexapod_pin.ground.contact import Restitution
from hexapod_pin.robot.once_per_robot import once_per_robot

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.controller import FootControl
    from hexapod_pin.errors import ParameterError
    from hexapod_pin.native import LegChain
    from hexapod_pin.robot.robot import Robot

Kept = TypeVar("Kept")

TOUCH_SPEEDS = (0.0, 0.1)
"""Of feet put down gently and in a walk [m/s] (*assumed*): contacts with a coefficient of
restitution are damped as by their touch speed, and the loop is to be stable with both."""

FAR = 1e9
"""Limits of the linear law: it has none [m]."""

KEPT = 64
"""Loops and verdicts of a robot that are kept."""


@dataclass
class KeptLoops:
    """What is known of a robot.

    Attributes:
        loops: by servos, contact, times, feet.
        chains: the legs without dry friction, by servos.
        verdicts: errors of controllers, or None, by all of their settings.
    """

    loops: OrderedDict[str, LinearLoop] = field(default_factory=OrderedDict)
    chains: OrderedDict[str, list[LegChain]] = field(default_factory=OrderedDict)
    verdicts: OrderedDict[str, ParameterError | None] = field(default_factory=OrderedDict)


@once_per_robot
def kept_loops(robot: Robot) -> KeptLoops:
    """Return what is known of a robot."""
    return KeptLoops()


def once(kept: OrderedDict[str, Kept], key: str, make: Callable[[], Kept]) -> Kept:
    """Return the value of a key, made once; the oldest of many goes."""
    if key not in kept:
        kept[key] = make()
        while len(kept) > KEPT:
            kept.popitem(last=False)
    return kept[key]


def plant_key(control: FootControl, scene: Any) -> str:
    """Return a text that differs where the loop of a robot differs, its controller's law aside."""
    times = f"{control.period!r} {control.loop_delay!r} {scene.gravity}"
    return f"{times} {scene.servos.model_dump_json()} {scene.contact.model_dump_json()}"


def stance_loop(
    control: FootControl, scene: Any, feet: Sequence[str] | None = None, touch_speed: float = 0.0
) -> LinearLoop:
    """Return the standing robot of a scene between the ticks of a controller.

    Args:
        control: its period and delays.
        scene: the robot, its servos and contact.
        feet: as of `StanceModel.of`.
        touch_speed: as of `StanceModel.of` [m/s].
    """
    key = f"{plant_key(control, scene)} {feet} {touch_speed!r}"

    def make() -> LinearLoop:
        stance = StanceModel.of(scene, feet, touch_speed)
        return LinearLoop.of(stance, control.period, control.loop_delay)

    return once(kept_loops(scene.robot).loops, key, make)


def linear_law(control: FootControl, scene: Any, stance: StanceModel) -> LinearLaw:
    """Return a controller's law about a stance, limits and dry friction aside."""
    from hexapod_pin.control.foot_control.ready_law import law_settings, native_law

    settings = law_settings(control, scene)
    slip, suspension = settings.slip, settings.suspension
    slip.limit = suspension.limit = FAR
    settings.slip, settings.suspension = slip, suspension
    chains = once(
        kept_loops(scene.robot).chains,
        scene.servos.model_dump_json(),
        lambda: leg_chains(scene, dry_friction=False),
    )
    return LinearLaw.of(native_law(scene, settings, chains), scene, stance)


def spectral_radius(
    control: FootControl,
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
    control: FootControl,
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
    for speed in speeds:
        loop = stance_loop(control, scene, feet, speed)
        law = law or linear_law(control, scene, loop.stance)
        yield loop.radius(law, drift_time)

"""The planned motion of the body, from the settings of a controller as a trace keeps them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hexapod_pin.control.body_path import BodyPath, PlanarMotion
from hexapod_pin.control.commanded_body import CommandedBody
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.velocity_command import VelocityCommand
from hexapod_pin.control.walk_schedule import last_motion


def planned_body(settings: Mapping[str, Any], speed: float | None = None) -> PlanarMotion | None:
    """Return the planned planar motion of the body; None where the settings plan none.

    Args:
        settings: `to_dict` of a controller: a walk on straight paths or arcs, with or without foot
            control.
        speed: of a gait whose own stroke is not what is walked, as on arcs [m/s].

    Raises:
        ParameterError, GaitError: the settings are not those of a gait.
    """
    walk = settings.get("walk", settings)
    if not isinstance(walk, Mapping) or not isinstance(walk.get("gait"), Mapping):
        return None
    gait = Gait(**walk["gait"])
    if "velocity" in walk:
        return CommandedBody(gait, VelocityCommand(**walk["velocity"]))
    if walk.get("kind") == "arc" and speed is not None:
        gait = gait.with_changes(stroke=speed * gait.duty * gait.cycle_time)
    return BodyPath(gait, halt=last_motion(gait, walk.get("stop_at")))

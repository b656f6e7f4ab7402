"""Numbers of a case's file by their path, such as "scene.contact.friction.mu"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hexapod_pin.control.registry import read_controller
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.simulation.loads import read_loads
from hexapod_pin.sweep.study.fields import suggestion

Steps = tuple[str | int, ...]

SECTIONS = ("controller", "run", "scene")
SCENE_PARTS = ("contact", "servo", "stops", "terrain", "gravity", "loads")
RUN_NUMBERS = ("duration", "accuracy", "step", "sample")

READERS: Mapping[str, Any] = {
    "controller": read_controller,
    "contact": lambda data: Contact(**data),
    "servo": lambda data: Servo(**data),
    "stops": lambda data: JointStops(**data),
    "terrain": read_terrain,
    "gravity": tuple,
    "loads": lambda data: tuple(read_loads(data)),
    "run": dict,
}
"""What makes a part of a case from its data."""


def part_of(steps: Steps) -> str:
    """Return the part of a case that a path leads into."""
    return str(steps[1] if steps[0] == "scene" else steps[0])


def steps_to(data: Mapping[str, Any], path: str, where: str) -> Steps:
    """Return the steps of a path to a number of a case's data.

    Args:
        data: what the case's file holds.
        path: the keys, with dots between them; a list's places are counted from 0.
        where: the path's own place in the study file.

    Raises:
        ParameterError: it leads nowhere, or not to a number; names what is there.
    """
    keys = path.split(".")
    if keys[0] == "scene" and len(keys) > 1:
        _require(where, path, "scene", keys[1], SCENE_PARTS)
    else:
        _require(where, path, "", keys[0], SECTIONS)
    found: Any = data
    steps: list[str | int] = []
    for depth, key in enumerate(keys):
        above = ".".join(keys[:depth])
        if isinstance(found, Mapping):
            _require(where, path, above, key, list(found))
            steps.append(key)
        elif isinstance(found, Sequence) and not isinstance(found, str):
            places = [str(k) for k in range(len(found))]
            _require(where, path, above, key, places)
            steps.append(int(key))
        else:
            raise ParameterError(where, path, f"a path that ends at {above} = {found!r}")
        found = found[steps[-1]]
    if isinstance(found, bool) or not isinstance(found, int | float):
        inside = f": {', '.join(map(str, found))}" if isinstance(found, Mapping) else ""
        kind = "a table" if isinstance(found, Mapping) else f"{found!r}"
        raise ParameterError(where, path, f"the path of a number; there stands {kind}{inside}")
    return tuple(steps)


def _require(where: str, path: str, above: str, key: str, known: Sequence[str]) -> None:
    if key not in known:
        place = f"in {above}" if above else "in a case's file"
        allowed = f"a path to a number: {place} there are {', '.join(known) or 'none'}"
        raise ParameterError(where, path, allowed, suggestion(key, known))


def with_number(data: Any, steps: Steps, value: float) -> Any:
    """Return data with one number replaced; what the path does not touch is shared."""
    if not steps:
        return int(value) if isinstance(data, int) and value % 1.0 == 0.0 else value
    copy: Any = dict(data) if isinstance(data, Mapping) else list(data)
    copy[steps[0]] = with_number(copy[steps[0]], steps[1:], value)
    return copy

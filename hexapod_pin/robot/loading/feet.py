"""Feet: spheres fixed to links, the only parts of a robot that touch the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.urdf_file import LARGEST_LENGTH, LARGEST_RADIUS, Sphere, UrdfFile
from hexapod_pin.robot.loading.limbs import Limbs
from hexapod_pin.robot.loading.pin_model import placement

if TYPE_CHECKING:
    import pinocchio as pin


@dataclass(frozen=True, eq=False)
class Foot(Immutable):
    """A sphere fixed to a link that may touch the ground.

    Attributes:
        name: name of its link.
        leg: name of its leg; None where the robot has no legs of three joints.
        joint: name of the joint that moves it ("root_joint" where it is fixed to the base).
        offset: (3,) centre of the sphere in that joint's frame [m].
        radius: radius [m]; 0 is a point foot.
    """

    name: str
    leg: str | None
    joint: str
    offset: Array
    radius: float


def place_feet(
    file: UrdfFile, model: pin.Model, limbs: Limbs, radius: float | None = None
) -> tuple[tuple[Foot, ...], list[str]]:
    """Return the feet with their spheres, and notes on feet that have none.

    Args:
        file: the URDF.
        model: its model.
        limbs: which links are feet.
        radius: radius of all feet [m]; None takes each link's collision sphere, else a point.

    Raises:
        ParameterError: a radius out of range.
        UrdfError: a collision sphere whose numbers are.
    """
    if radius is not None and not 0.0 <= radius <= LARGEST_RADIUS:
        raise ParameterError("foot_radius", radius, f"from 0 to {LARGEST_RADIUS:g} m")
    owner = {leg.foot: leg.name for leg in limbs.legs}
    feet, points = [], []
    for name in limbs.feet:
        sphere = file.link_by_name[name].collision_sphere
        if sphere is None and radius is None:
            points.append(name)
        sphere = _checked(file, name, sphere or Sphere(0.0, (0.0, 0.0, 0.0)))
        joint, place = placement(model, name)
        centre = read_only(place.act(np.array(sphere.centre)))
        size = sphere.radius if radius is None else float(radius)
        feet.append(Foot(name, owner.get(name), joint, centre, size))
    note = f"no collision sphere on {', '.join(points)}: point feet (or give foot_radius)"
    return tuple(feet), [note] if points else []


def _checked(file: UrdfFile, link: str, sphere: Sphere) -> Sphere:
    """Return a sphere whose numbers are possible."""
    if not all(map(math.isfinite, (sphere.radius, *sphere.centre))) or sphere.radius < 0:
        text = f"link {link!r}: collision sphere of radius {sphere.radius:g} m at {sphere.centre}"
        raise UrdfError(
            file.source,
            [f"{text}; must be numbers up to {LARGEST_LENGTH:g} m, the radius not negative"],
        )
    return sphere

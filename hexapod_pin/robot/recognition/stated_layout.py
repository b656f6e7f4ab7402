"""A file that states its legs is taken at its word: nothing is inferred."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hexapod_pin.arrays import read_only
from hexapod_pin.robot.description.urdf_file import Sphere, UrdfFile
from hexapod_pin.robot.loading.limbs import Leg
from hexapod_pin.robot.loading.stated_legs import stated_limbs
from hexapod_pin.robot.recognition.hints import RobotHints
from hexapod_pin.robot.recognition.layout import LegLayout, RobotLayout
from hexapod_pin.robot.recognition.leg_choice import held_place


def stated_layout(
    file: UrdfFile, hints: RobotHints, stated: Mapping[str, float], held: Mapping[str, float]
) -> RobotLayout | None:
    """Return the robot as its file states it; None where it states no legs, or hints oppose.

    Args:
        file: the URDF; the root link has x forward, y left, z up.
        hints: what the user says; another direction or other legs go before the file.
        stated: standing angles by joint name [rad].
        held: places of joints by name [rad or m].

    Raises:
        UrdfError: statements that do not fit the file.
    """
    if hints.legs is not None or hints.forward is not None:
        return None
    limbs = stated_limbs(file, hints.feet)
    if limbs is None:
        return None
    walking = {joint for leg in limbs.legs for joint in leg.joints}
    places = {
        joint.name: held_place(joint, held)
        for joint in file.joints
        if joint.moves and joint.name not in walking
    }
    legs = tuple(_leg(file, leg, places, hints.foot_radius) for leg in limbs.legs)
    angles = {joint: angle for joint, angle in stated.items() if joint in walking}
    return RobotLayout(read_only(np.eye(3)), legs, places, angles)


def _leg(file: UrdfFile, leg: Leg, places: Mapping[str, float], radius: float | None) -> LegLayout:
    """Return one stated leg; its foot is the link's first collision sphere, else a point."""
    carriers = {joint.child: joint for joint in file.joints}
    above, link = [], leg.foot
    while link in carriers:
        above.append(carriers[link].name)
        link = carriers[link].parent
    held = tuple(name for name in reversed(above) if name in places)
    sphere = file.link_by_name[leg.foot].collision_sphere or Sphere(0.0, (0.0, 0.0, 0.0))
    size = sphere.radius if radius is None else float(radius)
    return LegLayout(leg.name, leg.joints, held, leg.foot, leg.foot, read_only(sphere.centre), size)

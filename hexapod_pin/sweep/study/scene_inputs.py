"""Scenes with other contact, servos, ground, gravity and loads, by the package's own functions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hexapod_pin.control.six_legs import six_legs
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import GaitError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import AnyTerrain, Flat
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.loads import Load
from hexapod_pin.simulation.mass_changes import MassFactor
from hexapod_pin.simulation.payload import Payload
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.sweep.random_bumps import random_bumps
from hexapod_pin.sweep.study.gait_inputs import gait_of

Values = Mapping[str, Any]
Options = Mapping[str, Mapping[str, Any]]

LEAST_LENGTH = 0.5
"""Way for which there are bumps at least [m]."""


def contact_with(contact: Contact, values: Values) -> Contact:
    """Return a contact with another friction coefficient and stiffness."""
    if "friction" in values:
        contact = contact.with_mu(values["friction"])
    if "contact_stiffness" in values:
        contact = contact.stiffer(values["contact_stiffness"])
    return contact


def servo_with(servo: Servo, values: Values) -> Servo:
    """Return servos of another stiffness."""
    return servo.stiffer(values["servo_stiffness"]) if "servo_stiffness" in values else servo


def gravity_with(gravity: tuple[float, float, float], values: Values) -> tuple[float, float, float]:
    """Return gravity as on a slope that rises along +x: the ground stays level, gravity tilts."""
    angle = values["slope"] if "slope" in values else math.radians(values["slope_deg"])
    size = math.hypot(*gravity)
    return -size * math.sin(angle), 0.0, -size * math.cos(angle)


def loads_with(
    loads: tuple[Load, ...], values: Values, options: Options, trunk: str
) -> tuple[Load, ...]:
    """Return loads with mass factors and a payload more; one of 0 kg is none."""
    found = list(loads)
    if "mass" in values:
        found.append(MassFactor(values["mass"]))
    if "trunk_mass" in values:
        found.append(MassFactor(values["trunk_mass"], (trunk,)))
    if values.get("payload"):
        given = options["payload"]
        place = (0.0, 0.0, 0.0) if given["position"] is None else given["position"]
        found.append(Payload(given["link"] or trunk, values["payload"], place))
    return tuple(found)


def terrain_with(base: Case, values: Values, options: Options) -> AnyTerrain:
    """Return random bumps; those of height 0 are level ground."""
    height, given = values["bumps"], options["bumps"]
    if height == 0.0:
        return Flat()
    flat = given["flat_radius"]
    scene: Scene = random_bumps(
        base.scene,
        [int(values.get("bumps_seed", 0))],
        amplitude=height,
        wavelength=given["wavelength"],
        length=walked_length(base) if given["length"] is None else given["length"],
        flat_radius=standing_radius(base) if flat is None else flat,
    )[0]
    return scene.terrain


def standing_radius(base: Case) -> float:
    """Return how far the feet stand from the middle of the trunk, at most [m]; 0 without legs."""
    try:
        feet = six_legs(base.scene.robot).neutral_feet
    except GaitError:
        return 0.0
    return max(math.hypot(x, y) for x, y, _ in feet.tolist())


def refused_scene_input(base: Case, name: str) -> str:
    """Return why an input does not fit the scene of the base; empty where it does."""
    scene = base.scene
    if name == "servo_stiffness":
        if scene.prescribed:
            return "the base's motion is prescribed: no servo acts"
        if not scene.servos.gains(scene.robot)[0].any():
            return "the base's servos have no stiffness: kp = 0"
    if name in ("motor", "voltage") and scene.prescribed:
        return "the base's motion is prescribed: no motor acts"
    if name in ("slope", "slope_deg") and (scene.gravity[:2] != (0.0, 0.0) or scene.gravity[2] > 0):
        return "the base's gravity is tilted already"
    if name == "bumps" and not isinstance(scene.terrain, Flat):
        return f"the base's terrain is not level: {scene.terrain.kind}"
    return ""


def walked_length(base: Case) -> float:
    """Return the way of the base's gait in its duration [m]; 0.5 where that is less."""
    gait = gait_of(base.controller)
    speed = 0.0 if gait is None else gait.speed
    return max(LEAST_LENGTH, speed * (base.duration or 0.0))

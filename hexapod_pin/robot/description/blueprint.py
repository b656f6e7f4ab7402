"""A blueprint describes a hexapod as one table of numbers, from which its URDF is written.

Frames: base_link has x forward, y left, z up. Each leg's hip frame is yawed so that x points
outward; the joints turn about z (coxa), y (femur) and y (tibia); every link's x axis runs from
its own joint to the next one, so the tibia's x axis runs from the knee to the centre of the foot.
A positive femur or tibia angle lowers the foot; (0, 0, pi/2) is a level femur, tibia straight down.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description import urdf_writer as xml
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.solids import Vector, box_inertia, point_inertia, rod_inertia
from hexapod_pin.robot.description.urdf_writer import Shape
from hexapod_pin.spec import Kilograms, Metres, Spec

# The parts of a hexapod as validated numbers: trunk, leg segments with their joints, hips.

Positive = Annotated[float, Field(gt=0)]
Mass = Annotated[Kilograms, Field(gt=0)]
Length = Annotated[Metres, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Size = tuple[Positive, Positive, Positive]


class Trunk(Spec):
    """The trunk: a box, its frame at the centre of mass of the bare trunk."""

    mass: Mass
    """Mass without additional parts [kg]."""
    inertia: Size
    """(ixx, iyy, izz) about the centre of mass [kg m^2]."""
    size: Size
    """Edges of the box along x, y, z [m]: drawn only."""

    @classmethod
    def solid(cls, mass: float, size: Vector) -> Trunk:
        """Return the trunk as a solid box of this mass [kg] and these edges [m]."""
        return cls(mass=mass, inertia=box_inertia(mass, size), size=size)


class Segment(Spec):
    """One link of every leg and the joint that moves it; x runs along the link."""

    mass: Mass
    """Mass [kg]."""
    length: Length
    """Distance from its joint to the next joint, or to the centre of the foot [m]."""
    inertia: Size
    """(ixx, iyy, izz) about the centre of mass, axes parallel to the link's frame [kg m^2]."""
    com: float
    """Distance of the centre of mass from the joint, along x [m]."""
    width: Positive
    """Width along y [m] (a rod's diameter): drawn only."""
    height: Positive | None
    """Height along z [m]: drawn only; None for a rod."""
    lower: float
    """Lower joint limit [rad]."""
    upper: float
    """Upper joint limit [rad]."""
    effort: NotNegative
    """Largest joint torque [N m]."""
    velocity: Positive
    """Largest joint rate [rad/s]."""
    damping: NotNegative = 0.0
    """Viscous damping of the joint [N m s/rad]."""

    @model_validator(mode="after")
    def _limits_in_order(self) -> Segment:
        if self.lower > self.upper:
            raise ParameterError("Segment.lower", self.lower, f"at most upper = {self.upper} rad")
        return self

    @classmethod
    def box(
        cls, mass: float, size: Vector, limits: tuple[float, float], effort: float, velocity: float
    ) -> Segment:
        """Return a solid box of edges `size` [m], its length along x; limits in rad, N m, rad/s."""
        return cls(
            mass=mass, length=size[0], inertia=box_inertia(mass, size), com=size[0] / 2,
            width=size[1], height=size[2], lower=limits[0], upper=limits[1],
            effort=effort, velocity=velocity,
        )  # fmt: skip

    @classmethod
    def rod(
        cls, mass: float, length: float, radius: float, limits: tuple[float, float],
        effort: float, velocity: float,
    ) -> Segment:  # fmt: skip
        """Return a solid cylinder [m] with its axis along x; limits in rad, N m, rad/s."""
        return cls(
            mass=mass, length=length, inertia=rod_inertia(mass, length, radius), com=length / 2,
            width=2 * radius, height=None, lower=limits[0], upper=limits[1],
            effort=effort, velocity=velocity,
        )  # fmt: skip

    def shape(self) -> Shape:
        """Return the primitive that is drawn, in the link's frame."""
        centre = (self.length / 2, 0.0, 0.0)
        if self.height is None:
            return Shape("rod", (self.length, self.width / 2), centre)
        return Shape("box", (self.length, self.width, self.height), centre)


class Hip(Spec):
    """Where a leg is fixed to the trunk."""

    position: Vector
    """Origin of the coxa joint in base_link [m]."""
    yaw: float
    """Angle from forward to the leg's outward direction, about z [rad]."""


def six_hips(x: float, y: float) -> dict[str, Hip]:
    """Return hips at x, 0 and -x [m], y [m] to the left and right, each pointing sideways."""
    sides, rows = {"l": 1.0, "r": -1.0}, {"f": x, "m": 0.0, "r": -x}
    return {
        side + row: Hip(position=(forward, sign * y, 0.0), yaw=sign * math.pi / 2)
        for side, sign in sides.items()
        for row, forward in rows.items()
    }


# A hexapod as one table of numbers, from which its URDF is written.

SEGMENTS = ("coxa", "femur", "tibia")
COLOURS = {
    "trunk": (0.32, 0.38, 0.45, 1.0),
    "coxa": (0.90, 0.55, 0.20, 1.0),
    "femur": (0.75, 0.78, 0.80, 1.0),
    "tibia": (0.25, 0.45, 0.65, 1.0),
    "foot": (0.12, 0.12, 0.12, 1.0),
}


class Blueprint(Spec):
    """All numbers of a hexapod with six equal Z-Y-Y legs; `urdf()` writes the robot's file."""

    name: str
    title: str
    """One line: what this robot is."""
    source: str
    """One line: where its numbers come from."""
    assumed: tuple[str, ...] = ()
    """One statement per number or group of numbers that no source gives."""
    trunk: Trunk
    coxa: Segment
    femur: Segment
    tibia: Segment
    hips: dict[str, Hip]
    """Six legs: lf, lm, lr, rf, rm, rr."""
    foot_radius: NotNegative
    """Radius of the foot sphere, centred on the end of the tibia [m]."""
    posture: Vector
    """Standing angles of coxa, femur and tibia joint, the same on all legs [rad]."""
    additional_mass: NotNegative = 0.0
    """Mass of parts that belong to no body of the table [kg]."""
    additional_mass_placement: Literal["trunk", "joints"] = "trunk"
    """Point masses: one at the trunk's centre of mass, or 18 equal ones at the joints."""

    @model_validator(mode="after")
    def _complete(self) -> Blueprint:
        if sorted(self.hips) != sorted(LEG_NAMES):
            raise ParameterError("Blueprint.hips", list(self.hips), f"the legs {LEG_NAMES}")
        for segment, angle in zip(self.segments, self.posture, strict=True):
            if not segment.lower <= angle <= segment.upper:
                allowed = f"between {segment.lower} and {segment.upper} rad"
                raise ParameterError("Blueprint.posture", angle, allowed)
        return self

    @property
    def segments(self) -> tuple[Segment, Segment, Segment]:
        """Coxa, femur and tibia."""
        return self.coxa, self.femur, self.tibia

    @property
    def total_mass(self) -> float:
        """Mass of the whole robot [kg]."""
        legs = math.fsum(6 * segment.mass for segment in self.segments)
        return math.fsum([self.trunk.mass, legs, self.additional_mass])

    @classmethod
    def from_dimensions(
        cls, name: str, *, trunk: Trunk, coxa: Segment, femur: Segment, tibia: Segment,
        hip_x: float, hip_y: float, foot_radius: float, posture: Vector,
        title: str = "", source: str = "", assumed: tuple[str, ...] = (),
    ) -> Blueprint:  # fmt: skip
        """Describe a hexapod of your own from lengths and masses.

        Args:
            name: name of the robot.
            trunk: usually `Trunk.solid(mass, size)`.
            coxa: usually `Segment.box(...)`.
            femur: usually `Segment.box(...)`.
            tibia: usually `Segment.rod(...)`.
            hip_x: distance of front and rear hips from the middle ones [m].
            hip_y: distance of the hips from the middle plane [m].
            foot_radius: radius of the foot spheres [m].
            posture: standing angles of the coxa, femur and tibia joint [rad].
            title: what the robot is.
            source: where the numbers come from.
            assumed: statements of what is assumed.

        Raises:
            ParameterError: for a size, mass, limit or posture outside its range.
        """
        return cls(
            name=name, title=title or name, source=source or "dimensions given by the user",
            assumed=assumed, trunk=trunk, coxa=coxa, femur=femur, tibia=tibia,
            hips=six_hips(hip_x, hip_y), foot_radius=foot_radius, posture=posture,
        )  # fmt: skip

    def urdf(self) -> str:
        """Return the text of the robot's URDF."""
        legs = "".join(_leg(self, leg) for leg in LEG_NAMES)
        return f"{_head(self)}{_trunk(self)}{legs}</robot>\n"


def _head(blueprint: Blueprint) -> str:
    """Return the start of the file: provenance, standing posture, colours, MuJoCo's settings."""
    from xml.sax.saxutils import escape, quoteattr  # which bring the libraries of HTTP

    named = zip(SEGMENTS, blueprint.posture, strict=True)
    angles = [(segment, xml.number(angle)) for segment, angle in named]
    postures = "".join(
        f'    <posture joint="{leg}_{segment}_joint" angle="{angle}"/>\n'
        for leg in LEG_NAMES
        for segment, angle in angles
    )
    assumed = "".join(f"    <assumed>{escape(text)}</assumed>\n" for text in blueprint.assumed)
    colours = "".join(xml.material(name, rgba) for name, rgba in COLOURS.items())
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        "<!-- Written by hexapod_pin.Blueprint from a table: edit the table. -->\n"
        f"<robot name={quoteattr(blueprint.name)}>\n"
        f"  <hexapod_pin title={quoteattr(blueprint.title)} source={quoteattr(blueprint.source)}>\n"
        f"{postures}{assumed}  </hexapod_pin>\n"
        '  <mujoco><compiler fusestatic="false" discardvisual="false" balanceinertia="false" '
        'inertiafromgeom="false"/></mujoco>\n'
        f"{colours}"
    )


def _trunk(blueprint: Blueprint) -> str:
    """Return base_link with the additional parts it carries."""
    trunk = blueprint.trunk
    parts = [(blueprint.additional_mass, xml.ZERO)]
    if blueprint.additional_mass_placement == "joints":
        share = blueprint.additional_mass / 18
        parts = [(share, hip.position) for hip in blueprint.hips.values()]
    inertial = _inertial(trunk.mass, 0.0, trunk.inertia, parts)
    return xml.link("base_link", [inertial, xml.visual(Shape("box", trunk.size), "trunk")])


def _leg(blueprint: Blueprint, leg: str) -> str:
    """Return the four links and four joints of one leg."""
    hip, text = blueprint.hips[leg], ""
    parent, origin, yaw = "base_link", hip.position, hip.yaw
    for name, segment in zip(SEGMENTS, blueprint.segments, strict=True):
        child = f"{leg}_{name}"
        motion = xml.motion(
            (0, 0, 1) if name == "coxa" else (0, 1, 0), segment.lower, segment.upper,
            segment.effort, segment.velocity, segment.damping,
        )  # fmt: skip
        text += xml.joint(f"{child}_joint", parent, child, origin, yaw=yaw, motion=motion)
        text += xml.link(child, [_segment_inertial(blueprint, name, segment),
                                 xml.visual(segment.shape(), name)])  # fmt: skip
        parent, origin, yaw = child, (segment.length, 0.0, 0.0), 0.0
    text += xml.joint(f"{leg}_foot_joint", parent, f"{leg}_foot", origin)
    sphere = Shape("sphere", (blueprint.foot_radius,))
    touching = [xml.visual(sphere, "foot"), xml.collision(sphere)] if blueprint.foot_radius else []
    return text + xml.link(f"{leg}_foot", touching)


def _segment_inertial(blueprint: Blueprint, name: str, segment: Segment) -> str:
    """Return a leg link's inertial; coxa and femur carry the motor of the next joint, if any."""
    parts: list[tuple[float, Vector]] = []
    if blueprint.additional_mass_placement == "joints" and name != "tibia":
        parts = [(blueprint.additional_mass / 18, (segment.length, 0.0, 0.0))]
    return _inertial(segment.mass, segment.com, segment.inertia, parts)


def _inertial(mass: float, com: float, moments: Vector, parts: list[tuple[float, Vector]]) -> str:
    """Return the inertial of a body (com along x) together with point masses fixed to it.

    The parallel-axis theorem about the common centre of mass; nothing is changed where the
    point masses sit at the body's own centre of mass.
    """
    masses = np.array([mass, *(part for part, _ in parts)])
    places = np.array([(com, 0.0, 0.0), *(place for _, place in parts)])
    total = math.fsum(masses)
    centre = places[0] if np.ptp(places, axis=0).max() == 0 else masses @ places / total
    inertia = np.diag(moments).astype(float)
    for part, arm in zip(masses, places - centre, strict=True):
        inertia += part * point_inertia(arm)
    return xml.inertial(total, tuple(centre.tolist()), inertia.tolist())

"""URDF elements as text: links, joints and shapes, numbers in shortest round-trip form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hexapod_pin.robot.description.solids import Vector

ZERO: Vector = (0.0, 0.0, 0.0)


class Shape(NamedTuple):
    """A primitive: kind "box" (edges x, y, z), "rod" (length along x, radius), "sphere" (radius).

    Sizes and the centre, in the link's frame, are in metres.
    """

    kind: str
    size: tuple[float, ...]
    centre: Vector = ZERO


def number(value: float) -> str:
    """Return the shortest text that reads back as the same float; no negative zero."""
    text = repr(float(value) + 0.0)
    return text.removesuffix(".0")


def numbers(values: Sequence[float]) -> str:
    """Join numbers with blanks, as in an xyz attribute."""
    return " ".join(number(value) for value in values)


def inertial(mass: float, com: Vector, inertia: Sequence[Sequence[float]]) -> str:
    """Return an <inertial> element.

    Args:
        mass: mass [kg].
        com: centre of mass in the link's frame [m].
        inertia: (3, 3) matrix about the centre of mass, in axes parallel to the link's [kg m^2].
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    moments = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (xx, yy, zz, xy, xz, yz), strict=True)
    attributes = " ".join(f'{name}="{number(value)}"' for name, value in moments)
    return (
        "    <inertial>\n"
        f'      <origin xyz="{numbers(com)}" rpy="0 0 0"/>\n'
        f'      <mass value="{number(mass)}"/>\n'
        f"      <inertia {attributes}/>\n"
        "    </inertial>\n"
    )


def geometry(shape: Shape) -> str:
    """Return the <origin> and <geometry> of a shape (URDF cylinders lie along z: turned to x)."""
    rpy = "0 0 0"
    if shape.kind == "box":
        body = f'<box size="{numbers(shape.size)}"/>'
    elif shape.kind == "rod":
        length, radius = shape.size
        body = f'<cylinder length="{number(length)}" radius="{number(radius)}"/>'
        rpy = "0 1.5707963267948966 0"
    else:
        body = f'<sphere radius="{number(shape.size[0])}"/>'
    return f'<origin xyz="{numbers(shape.centre)}" rpy="{rpy}"/><geometry>{body}</geometry>'


def link(name: str, parts: Sequence[str]) -> str:
    """Return a <link> element made of `parts` (inertial, visual, collision)."""
    from xml.sax.saxutils import quoteattr  # which brings the libraries of HTTP

    return f"  <link name={quoteattr(name)}>\n" + "".join(parts) + "  </link>\n"


def visual(shape: Shape, material: str) -> str:
    """Return a <visual> element in a material named at the top of the file."""
    return f'    <visual>{geometry(shape)}<material name="{material}"/></visual>\n'


def collision(shape: Shape) -> str:
    """Return a <collision> element."""
    return f"    <collision>{geometry(shape)}</collision>\n"


def material(name: str, rgba: Sequence[float]) -> str:
    """Return a named <material> with its colour (red, green, blue, opacity: 0 to 1)."""
    return f'  <material name="{name}"><color rgba="{numbers(rgba)}"/></material>\n'


def joint(
    name: str, parent: str, child: str, xyz: Vector, *, yaw: float = 0.0, motion: str = ""
) -> str:
    """Return a <joint> element: fixed, or revolute when it is given its motion.

    Args:
        name: joint name.
        parent: parent link.
        child: child link.
        xyz: origin of the child's frame in the parent's frame [m].
        yaw: turn of the child's frame about the parent's z axis [rad].
        motion: what `motion` returns; empty for a fixed joint.
    """
    kind = "revolute" if motion else "fixed"
    return (
        f'  <joint name="{name}" type="{kind}">\n'
        f'    <parent link="{parent}"/><child link="{child}"/>\n'
        f'    <origin xyz="{numbers(xyz)}" rpy="0 0 {number(yaw)}"/>\n'
        f"{motion}  </joint>\n"
    )


def motion(
    axis: Vector, lower: float, upper: float, effort: float, velocity: float, damping: float
) -> str:
    """Return the axis, limits and damping of a revolute joint [rad, N m, rad/s, N m s/rad]."""
    return (
        f'    <axis xyz="{numbers(axis)}"/>\n'
        f'    <limit lower="{number(lower)}" upper="{number(upper)}" '
        f'effort="{number(effort)}" velocity="{number(velocity)}"/>\n'
        f'    <dynamics damping="{number(damping)}" friction="0"/>\n'
    )

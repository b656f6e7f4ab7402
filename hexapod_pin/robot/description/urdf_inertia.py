"""Masses and inertias of a URDF: what moves together must be a possible rigid body."""

from __future__ import annotations

import math

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import Link, UrdfFile

INERTIA_RELATIVE_TOLERANCE = 1e-9
"""Relative slack of the triangle inequality and of positive eigenvalues (round-off in the file)."""

NEGLIGIBLE_INERTIA_SHARE = 1e-3
"""Share of its body's largest moment below which one fixed link's impossible inertia is a note."""

THICK, THIN = 10.0, 0.01
"""A radius of gyration beyond these multiples of the link's extent is suspicious."""


def inertia_findings(file: UrdfFile) -> list[str]:
    """Return unreadable inertials, and bodies that move but cannot be rigid bodies with mass."""
    unreadable = {link.name: text for link in file.links if (text := _unreadable(link))}
    findings = list(unreadable.values())
    for group in bodies(file):
        if not any(name in unreadable for name in group):
            findings += _body_findings(file, group)
    return findings


def bodies(file: UrdfFile) -> list[list[str]]:
    """Return the links of every rigid body that moves: its first link, then those fixed to it."""
    heads = [file.base, *(joint.child for joint in file.joints if joint.moves)]
    return [file.rigid_group(head) for head in heads]


def inertia_notes(file: UrdfFile) -> list[str]:
    """Return links whose inertia is suspicious, though the body they belong to is possible.

    Either the radius of gyration does not fit the link's size (a unit slip, usually), or the
    link alone is no rigid body but too small to matter.
    """
    notes = []
    for link in file.links:
        extent = _extent(file, link)
        if not link.mass:
            continue
        if broken := _broken(link, INERTIA_RELATIVE_TOLERANCE):
            notes.append(f"{broken}; negligible within the body it is fixed to")
        gyration = math.sqrt(max(0.0, *np.linalg.eigvalsh(inertia_matrix(link))) / link.mass)
        if extent and not THIN * extent <= gyration <= THICK * extent:
            notes.append(
                f"link {link.name!r}: radius of gyration {gyration:.3g} m against a size of"
                f" {extent:.3g} m; check the unit of its inertia (kg m^2)"
            )
    return notes


def inertia_matrix(link: Link) -> Array:
    """Return the (3, 3) inertia about the centre of mass in the link's axes [kg m^2]."""
    xx, yy, zz, xy, xz, yz = link.moments
    turn = rotation(link.inertia_rpy)
    matrix: Array = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return matrix


def rotation(rpy: tuple[float, ...]) -> Array:
    """Return the (3, 3) rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, sp, sy), (cr, cp, cy) = map(math.sin, rpy), map(math.cos, rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _unreadable(link: Link) -> str:
    """Say what no body can have: a mass or an inertia that is negative, missing or no number."""
    mass = link.mass
    if mass is None:
        return ""
    if not math.isfinite(mass) or mass < 0:
        written = link.element.find("inertial/mass")
        value = None if written is None else written.get("value")
        return f"link {link.name!r}: mass {value!r} kg; must be a finite number, not negative"
    if not all(map(math.isfinite, link.com + link.inertia_rpy + link.moments)):
        return f"link {link.name!r}: its inertial has missing or non-finite numbers"
    return ""


def _broken(link: Link, slack: float, scale: float = 0.0) -> str:
    """Say how a link's inertia is impossible by more than slack * (its largest moment or scale)."""
    small, middle, large = np.linalg.eigvalsh(inertia_matrix(link))
    tolerance = slack * max(abs(large), scale)
    moments = f"principal moments {small:.6g}, {middle:.6g}, {large:.6g} kg m^2"
    if small < -tolerance:
        return f"link {link.name!r}: inertia is not positive definite: {moments}"
    if small + middle < large - tolerance:
        return (
            f"link {link.name!r}: {moments} break the triangle inequality:"
            " the two smaller ones must add up to the largest at least"
        )
    return ""


def _body_findings(file: UrdfFile, group: list[str]) -> list[str]:
    """Return what is wrong with a body that moves: its first link and those fixed to it."""
    head, fixed = group[0], group[1:]
    where = f"link {head!r}" + (f" (with {', '.join(fixed)} fixed to it)" if fixed else "")
    mover = "the floating base" if head == file.base else "a joint"
    mass = math.fsum(file.link_by_name[name].mass or 0.0 for name in group)
    if mass <= 0:
        written = file.link_by_name[head].mass
        value = "no <inertial>" if written is None else f"mass {written:g} kg"
        return [f"{where}: {value}, but {mover} moves it; its mass must be above 0"]
    heavy = [file.link_by_name[name] for name in group if file.link_by_name[name].mass]
    smallest, _, largest = np.linalg.eigvalsh(body_inertia(file, group))
    slack, scale = (
        (INERTIA_RELATIVE_TOLERANCE, 0.0)
        if len(heavy) == 1
        else (NEGLIGIBLE_INERTIA_SHARE, float(largest))
    )
    broken = [text for link in heavy if (text := _broken(link, slack, scale))]
    if not broken and smallest <= INERTIA_RELATIVE_TOLERANCE * largest:
        broken = [
            f"{where}: moved by {mover}, but its inertia is not positive definite:"
            f" smallest principal moment {smallest:.6g} kg m^2"
        ]
    return broken


def body_inertia(file: UrdfFile, group: list[str]) -> Array:
    """Return the (3, 3) inertia [kg m^2] of a rigid group about its common centre of mass."""
    places = _placements(file, group)
    heavy = [(file.link_by_name[n], *places[n]) for n in group if file.link_by_name[n].mass]
    masses = np.array([link.mass for link, _, _ in heavy])
    centres = np.array([p + turn @ np.array(link.com) for link, turn, p in heavy])
    arms = centres - masses @ centres / masses.sum()
    total = np.zeros((3, 3))
    for (link, turn, _), mass, arm in zip(heavy, masses, arms, strict=True):
        total += turn @ inertia_matrix(link) @ turn.T
        total += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return total


def _placements(file: UrdfFile, group: list[str]) -> dict[str, tuple[Array, Array]]:
    """Return rotation and position of every link of a rigid group in its first link's frame."""
    places = {group[0]: (np.eye(3), np.zeros(3))}
    for name in group:
        turn, position = places[name]
        for joint in file.joints_below[name]:
            if not joint.moves:
                xyz = position + turn @ np.array(joint.xyz)
                places[joint.child] = (turn @ rotation(joint.rpy), xyz)
    return places


def _extent(file: UrdfFile, link: Link) -> float:
    """Return a size of the link [m] from its joints and primitives; 0 where they tell none."""
    sizes = [math.hypot(*joint.xyz) for joint in file.joints_below[link.name]]
    for geometry in link.element.iter("geometry"):
        for shape in geometry:
            words = [*(shape.get("size") or "").split(), shape.get("length"), shape.get("radius")]
            sizes += [_size(word) for word in words if word is not None]
    known = max((size for size in sizes if math.isfinite(size)), default=0.0)
    return max(known, math.hypot(*link.com)) if known else 0.0


def _size(word: str) -> float:
    """Return a length written in the file, NaN where it is no number."""
    try:
        return abs(float(word))
    except ValueError:
        return math.nan

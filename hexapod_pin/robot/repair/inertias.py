"""Faults of inertias are found and repaired.

What moves together must be a possible rigid body of its size.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.solids import (
    INERTIA_RELATIVE_TOLERANCE,
    bodies,
    body_inertia,
    inertia_matrix,
    principal_moments,
)
from hexapod_pin.robot.description.urdf_file import Link
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import SAME_INERTIA
from hexapod_pin.robot.repair.finding import Draft, Finding, number, scaled
from hexapod_pin.robot.repair.measures import Measures
from hexapod_pin.robot.repair.rules import FLATNESS
from hexapod_pin.robot.repair.structure import tree_of, trunk_root
from hexapod_pin.robot.repair.units import (
    LEAST_REACH,
    gyration,
    inertia_slip,
    placeholder,
    readable,
)
from hexapod_pin.robot.rotations import rotation

NEGLIGIBLE_INERTIA_SHARE = 1e-3
"""Share of its body's largest moment below which one fixed link's impossible inertia is a note."""

REPAIR_MASS = "that of other legs' part; else from the solid and --density, or its share of --mass"
REPAIR_NEAREST = "the nearest possible moments; those of the link's solid where they do not fit it"
CORRECT_SIZE = "correct it by hand: what is drawn of the link fits its size no better"
REPAIR_SOLID = "that of the link's solid, or of a rod to its next joint, with the link's mass"


def inertia_findings(measures: Measures) -> list[Finding]:
    """Return unreadable inertials, impossible bodies, and inertias that do not fit their size."""
    file = measures.file
    unreadable = {link.name: bad for link in file.links if (bad := _unreadable(link))}
    findings = list(unreadable.values())
    refused = set(unreadable)
    for group in bodies(file):
        if not refused.intersection(group):
            found = list(_of_body(measures, group))
            findings += found
            refused.update(name for name in group if any(repr(name) in x.where for x in found))
    findings += _same_inertia(measures)
    for link in file.links:
        if link.name not in unreadable:
            findings += _of_size(measures, link, judged=link.name in refused)
    return findings


def broken(link: Link, slack: float = INERTIA_RELATIVE_TOLERANCE, scale: float = 0.0) -> str:
    """Return how a link's inertia is impossible by more than slack * (largest moment or scale)."""
    small, middle, large = principal_moments(inertia_matrix(link))
    tolerance = slack * max(abs(large), scale)
    moments = f"principal moments {small:.6g}, {middle:.6g}, {large:.6g} kg m^2"
    if small < -tolerance:
        return f"inertia is not positive definite: {moments}"
    if small + middle < large - tolerance:
        return f"{moments} break the triangle inequality"
    return ""


def size_of(measures: Measures, link: Link) -> tuple[float, tuple[float, float]]:
    """Return a link's size [m] (0: unknown), and the allowed radii of gyration over it."""
    solid = measures.solid(link)
    if solid is not None:
        return max(solid.extent, measures.reach(link)), rules.GYRATION
    reach = measures.reach(link)
    if reach:
        return max(reach, math.hypot(*link.com)), rules.GYRATION_OF_SKELETON
    return measures.span, (0.0, rules.GYRATION[1])


def misfit(measures: Measures, link: Link) -> str:
    """Return how the radius of gyration of a readable link does not fit its size, else ""."""
    size, (low, high) = size_of(measures, link)
    if not size or low * size <= gyration(link) <= high * size:
        return ""
    return f"radius of gyration {gyration(link):.3g} m against a size of {size:.3g} m"


def replaceable(measures: Measures, link: Link) -> bool:
    """Whether the inertia of a link's body, with its mass, fits its size."""
    body, (size, (low, high)) = measures.body(link), size_of(measures, link)
    if body is None:
        return True
    largest = float(np.linalg.eigvalsh(body.inertia)[-1]) / body.volume
    return low * size <= math.sqrt(max(largest, 0.0)) <= high * size


def off_centre(measures: Measures, link: Link) -> str:
    """Return how far the centre of mass lies outside what is drawn; "" where it does not."""
    solid = measures.solid(link)
    if not readable(link):
        return ""
    if solid is None:
        return _off_joints(measures, link)
    distance = float(np.linalg.norm(np.array(link.com) - solid.centre))
    if distance <= rules.CENTRE_OFFSET * max(solid.extent, measures.reach(link)):
        return ""
    return f"centre of mass {distance:.3g} m off a body {solid.extent:.3g} m large"


def _off_joints(measures: Measures, link: Link) -> str:
    """Return how far the centre of mass of a link of which nothing is drawn lies off its joints."""
    reach, far = measures.reach(link), rules.CENTRE_OFF_JOINTS
    if reach <= LEAST_REACH * measures.span:  # of an end, of which the length is not known
        reach = measures.leg_length if measures.plausible_size else 0.0
    distance = math.hypot(*link.com)
    if not reach or distance <= far * reach:
        return ""
    return f"centre of mass {distance:.3g} m from its joint, the next {reach:.3g} m"


def dummy(measures: Measures, link: Link) -> bool:
    """Whether what is drawn of a link would be lighter than air."""
    solid = measures.solid(link)
    return solid is not None and 0.0 < (link.mass or 0.0) < rules.LIGHTEST * solid.volume


def impossible_mass(link: Link) -> str:
    """Return the mass of a link as it is written where no body can have it; else ""."""
    if link.mass is None or (math.isfinite(link.mass) and link.mass >= 0.0):
        return ""
    written = link.element.find("inertial/mass")
    return repr(None if written is None else written.get("value"))


def _unreadable(link: Link) -> Finding | None:
    """Return what no body can have: a mass or inertia that is negative, missing or no number."""
    where = f"link {link.name!r}"
    if link.mass is None:
        return None
    if written := impossible_mass(link):
        rule = "must be a finite number, not negative"
        return Finding("unreadable mass", where, f"mass {written} kg", rule, REPAIR_MASS)
    if not _is_readable(link):
        return Finding(
            "unreadable inertial",
            where,
            "its inertial has missing or non-finite numbers",
            "origin, ixx, iyy, izz, ixy, ixz, iyz are numbers",
            REPAIR_SOLID,
        )
    return None


def _of_body(measures: Measures, group: list[str]) -> Iterator[Finding]:
    """Return what is wrong with a body that moves: its first link and those fixed to it."""
    file, head, fixed = measures.file, group[0], group[1:]
    where = f"link {head!r}" + (f" (with {', '.join(fixed)} fixed to it)" if fixed else "")
    mover = "the floating base" if head in file.roots else "a joint"
    links = [file.link_by_name[name] for name in group]
    if math.fsum(link.mass or 0.0 for link in links) <= 0.0:
        yield _massless(measures, where, links[0], mover)
        return
    heavy = [link for link in links if link.mass]
    smallest, _, largest = principal_moments(body_inertia(file, group))
    slack, scale = (
        (INERTIA_RELATIVE_TOLERANCE, 0.0)
        if len(heavy) == 1
        else (NEGLIGIBLE_INERTIA_SHARE, float(largest))
    )
    rule = "positive, and the two smaller ones add up to the largest at least"
    found = [(link, text) for link in heavy if (text := broken(link, slack, scale))]
    for link, text in found:
        yield Finding("impossible inertia", f"link {link.name!r}", text, rule, REPAIR_NEAREST)
    if not found and not smallest > INERTIA_RELATIVE_TOLERANCE * largest:
        kind = "zero inertia" if largest == 0.0 else "impossible inertia"
        value = f"inertia is not positive definite: smallest principal moment {smallest:.6g} kg m^2"
        yield Finding(kind, where, value, f"{mover} moves it: all moments above 0", REPAIR_SOLID)


def _massless(measures: Measures, where: str, head: Link, mover: str) -> Finding:
    if head.mass is None:
        value, kind = f"no <inertial>, but {mover} moves it", "no inertial"
    else:
        value, kind = f"mass {head.mass:g} kg, but {mover} moves it", "zero mass"
    file, root = measures.file, trunk_root(measures.file)
    links = [file.link_by_name[name] for name in ([] if root is None else tree_of(file, root))
             if name in file.link_by_name]  # fmt: skip
    known = any((link.mass or 0.0) > 0.0 or measures.body(link) for link in links)
    repair = REPAIR_MASS if known else "write masses: the file gives no mass and no size"
    return Finding(kind, where, value, "its mass must be above 0", repair, repairable=known)


def _same_inertia(measures: Measures) -> Iterator[Finding]:
    """Yield that links of different masses have one inertia, which fits hardly any of them."""
    moments = placeholder(measures)
    if moments is None:
        return
    alike = [link for link in measures.file.links if readable(link) and link.moments == moments]
    if 2 * sum(bool(misfit(measures, link)) for link in alike) > len(alike):
        value = f"{max(moments):.3g} kg m^2 of {len(alike)} links of different masses"
        yield Finding(
            SAME_INERTIA, "robot", value, "each link has its own", REPAIR_SOLID, "suspicious"
        )


def _of_size(measures: Measures, link: Link, judged: bool) -> Iterator[Finding]:
    """Return what is suspicious about a readable link: too light, too heavy, of another size."""
    where, solid = f"link {link.name!r}", measures.solid(link)
    if not readable(link):
        return
    if solid is not None and dummy(measures, link):
        yield Finding(
            "dummy mass",
            where,
            f"mass {link.mass:g} kg for {solid.volume * 1e3:.3g} litres",
            f"denser than air ({rules.LIGHTEST:g} kg/m^3)",
            REPAIR_MASS,
            "suspicious",
        )
    if solid is not None and (link.mass or 0.0) > rules.DENSEST_LINK * solid.volume:
        yield Finding.of(
            "too dense", where, f"mass {link.mass:g} kg for {solid.volume * 1e3:.3g} litres"
        )
    if not judged and (text := broken(link)):
        yield Finding(
            "impossible inertia",
            where,
            f"{text}; negligible within its body",
            "positive, and the two smaller ones add up to the largest at least",
            REPAIR_NEAREST,
            "suspicious",
        )
    if text := misfit(measures, link):
        fits = replaceable(measures, link)
        yield Finding(
            "inertia against size",
            where,
            text,
            "check the unit of its inertia (kg m^2): no body is so large or small",
            REPAIR_SOLID if fits else CORRECT_SIZE,
            "suspicious",
            repairable=fits,
        )
    if text := off_centre(measures, link):
        yield Finding.of("centre of mass outside", where, text)


# Repairs of inertias: units, impossible ones, and those that do not fit their link.


def repair_inertias(draft: Draft) -> None:
    """Bring inertias to kg m^2, then repair link by link; masses stay."""
    slip = inertia_slip(draft.measures)
    if slip is not None:
        power = round(math.log10(slip.factor))
        for inertia in draft.root.findall("link/inertial/inertia"):
            for name in ENTRIES:
                if inertia.get(name) is not None:
                    inertia.set(name, scaled(inertia.get(name) or "", power))
        text = f"all inertias multiplied by {slip.factor:g}: {slip.value}"
        draft.change("robot", text, f"inertias were in {slip.unit}")
    measures = draft.measures
    for link in measures.file.links:
        if link.mass:
            _repair_link(draft, measures, link)
        elif link.mass is not None and not _is_readable(link):
            link.element.remove(link.element.find("inertial"))  # type: ignore[arg-type]
            why = "it has no mass, and missing or non-finite numbers"
            draft.change(f"link {link.name!r}", f"inertial dropped: {why}")


def _repair_link(draft: Draft, measures: Measures, link: Link) -> None:
    """Repair one link with mass: first the moments alone, then, if they do not fit, all of it."""
    if not _is_readable(link):
        _replace(draft, measures, link, "its inertial has missing or non-finite numbers")
        return
    smallest, _, largest = principal_moments(inertia_matrix(link))
    if largest <= 0.0:
        _replace(draft, measures, link, "zero inertia")
    elif (text := misfit(measures, link)) and replaceable(measures, link):
        _replace(draft, measures, link, text)
    elif text := off_centre(measures, link):
        _replace(draft, measures, link, text)
    elif broken(link) or smallest <= INERTIA_RELATIVE_TOLERANCE * largest:
        _project(draft, measures, link)


def _is_readable(link: Link) -> bool:
    """Whether place, axes and moments of a link are numbers."""
    return all(map(math.isfinite, (*link.com, *link.inertia_rpy, *link.moments)))


def _project(draft: Draft, measures: Measures, link: Link) -> None:
    """Write the nearest possible moments; the body's own where they do not fit the size."""
    element = link.element.find("inertial/inertia")
    if element is None:
        return
    before, turn = _moments(link), rotation(link.inertia_rpy)
    old = element.attrib.copy()
    write_moments(element, turn.T @ nearest_possible(inertia_matrix(link)) @ turn)
    if misfit(measures, link):
        element.attrib.update(old)
        _replace(draft, measures, link, "its inertia is impossible and fits no body of its size")
        return
    text = f"principal moments {before} -> {_moments(link)} kg m^2, the nearest possible"
    draft.change(f"link {link.name!r}", text, "inertia nearest to an impossible one in the file")


def _replace(draft: Draft, measures: Measures, link: Link, why: str) -> None:
    """Write the inertia of the link's body with its mass; drop it on small fixed links."""
    mass, body, where = link.mass or 0.0, measures.body(link), f"link {link.name!r}"
    moved = {joint.child for joint in measures.file.joints if joint.moves}
    if body is None and link.name not in moved and link.name not in measures.file.roots:
        if mass <= rules.SMALL_SHARE * measures.total_mass:
            link.element.remove(link.element.find("inertial"))  # type: ignore[arg-type]
            draft.change(where, f"inertial of {mass:g} kg dropped: {why}, and nothing is drawn")
            return
    before = _moments(link)
    if body is None:
        radius = rules.SMALL_SIZE * (measures.size or 1.0)
        known = all(map(math.isfinite, link.com)) and not off_centre(measures, link)
        com = np.array(link.com) if known else np.zeros(3)
        inertia, shape = 0.4 * mass * radius**2 * np.eye(3), f"a ball of radius {radius:.2g} m"
    else:
        com, inertia = body.centre, mass / body.volume * body.inertia
        drawn = measures.solid(link) is not None
        shape = "its hull" if drawn else "a rod or plate between its joints"
    write_inertial(link.element, mass, com, inertia)
    text = f"principal moments {before} -> {_moments(link)} kg m^2 ({why})"
    draft.change(where, text, f"inertia and centre of mass of {shape}, uniform, with its mass")


def _moments(link: Link) -> str:
    return ", ".join(f"{value:.3g}" for value in principal_moments(inertia_matrix(link)))


# Writing the <inertial> of a link.

ENTRIES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}


def write_inertial(link: ET.Element, mass: float, com: Array, inertia: Array) -> None:
    """Replace the <inertial> of a link.

    Args:
        link: the <link>.
        mass: [kg].
        com: centre of mass in the link's frame [m]. Shape (3,).
        inertia: about it, in the link's axes [kg m^2]. Shape (3, 3).
    """
    old = link.find("inertial")
    if old is not None:
        link.remove(old)
    inertial = ET.Element("inertial")
    inertial.tail = "\n    "
    xyz = " ".join(number(value) for value in com)
    ET.SubElement(inertial, "origin", {"xyz": xyz, "rpy": "0 0 0"})
    ET.SubElement(inertial, "mass", {"value": number(mass)})
    write_moments(ET.SubElement(inertial, "inertia"), inertia)
    link.insert(0, inertial)


def write_moments(element: ET.Element, inertia: Array) -> None:
    """Write a (3, 3) inertia [kg m^2] into an <inertia> element."""
    for name, place in ENTRIES.items():
        element.set(name, number(float(inertia[place])))


# The nearest inertia that a rigid body can have.

SECOND_MOMENTS = np.ones((3, 3)) - np.eye(3)
"""Principal moments are this matrix times the second moments of mass, which no body has negative
(Traversaro, Brossette, Escande, Nori: Identification of fully physical consistent inertial
parameters using optimization on manifolds, IROS 2016)."""


def nearest_possible(inertia: Array) -> Array:
    """Return the possible inertia nearest to a (3, 3) one in the Frobenius norm [kg m^2].

    Its principal axes stay; its moments are the nearest that obey the triangle inequality, every
    second moment being at least `FLATNESS` of their sum.
    """
    from scipy.optimize import nnls

    moments, axes = np.linalg.eigh(inertia)
    scale = float(np.abs(moments).max())
    if scale == 0.0:
        return np.zeros((3, 3))
    second, _ = nnls(SECOND_MOMENTS, moments / scale)
    second = scale * np.maximum(second, FLATNESS * second.sum())
    nearest: Array = axes @ np.diag(SECOND_MOMENTS @ second) @ axes.T
    return nearest

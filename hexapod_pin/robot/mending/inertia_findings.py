"""Masses and inertias: what moves together must be a possible rigid body, of its size."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hexapod_pin.robot.description.urdf_file import Link
from hexapod_pin.robot.description.urdf_inertia import (
    INERTIA_RELATIVE_TOLERANCE,
    bodies,
    body_inertia,
    inertia_matrix,
    principal_moments,
)
from hexapod_pin.robot.mending import rules
from hexapod_pin.robot.mending.finding import Finding
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.structure_findings import tree_of, trunk_root
from hexapod_pin.robot.mending.units import gyration, readable

NEGLIGIBLE_INERTIA_SHARE = 1e-3
"""Share of its body's largest moment below which one fixed link's impossible inertia is a note."""

MEND_MASS = "that of other legs' part; else from the solid and --density, or its share of --mass"
MEND_NEAREST = "the nearest possible moments; those of the link's solid where they do not fit it"
CORRECT_SIZE = "correct it by hand: what is drawn of the link fits its size no better"
MEND_SOLID = "that of the link's solid, or of a rod to its next joint, with the link's mass"


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
    for link in file.links:
        if link.name not in unreadable:
            findings += _of_size(measures, link, judged=link.name in refused)
    return findings


def broken(link: Link, slack: float = INERTIA_RELATIVE_TOLERANCE, scale: float = 0.0) -> str:
    """Say how a link's inertia is impossible by more than slack * (its largest moment or scale)."""
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
    """Say how the radius of gyration of a readable link does not fit its size; "" where it does."""
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
    """Say how far the centre of mass lies outside what is drawn; "" where it does not."""
    solid = measures.solid(link)
    if solid is None or not readable(link):
        return ""
    distance = float(np.linalg.norm(np.array(link.com) - solid.centre))
    if distance <= rules.CENTRE_OFFSET * max(solid.extent, measures.reach(link)):
        return ""
    return f"centre of mass {distance:.3g} m off a body {solid.extent:.3g} m large"


def dummy(measures: Measures, link: Link) -> bool:
    """Whether what is drawn of a link would be lighter than air."""
    solid = measures.solid(link)
    return solid is not None and 0.0 < (link.mass or 0.0) < rules.LIGHTEST * solid.volume


def _unreadable(link: Link) -> Finding | None:
    """Return what no body can have: a mass or inertia that is negative, missing or no number."""
    where, mass = f"link {link.name!r}", link.mass
    if mass is None:
        return None
    if not math.isfinite(mass) or mass < 0:
        written = link.element.find("inertial/mass")
        value = None if written is None else written.get("value")
        return Finding(
            "unreadable mass",
            where,
            f"mass {value!r} kg",
            "must be a finite number, not negative",
            MEND_MASS,
        )
    if not all(map(math.isfinite, link.com + link.inertia_rpy + link.moments)):
        return Finding(
            "unreadable inertial",
            where,
            "its inertial has missing or non-finite numbers",
            "origin, ixx, iyy, izz, ixy, ixz, iyz are numbers",
            MEND_SOLID,
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
        yield Finding("impossible inertia", f"link {link.name!r}", text, rule, MEND_NEAREST)
    if not found and not smallest > INERTIA_RELATIVE_TOLERANCE * largest:
        kind = "zero inertia" if largest == 0.0 else "impossible inertia"
        value = f"inertia is not positive definite: smallest principal moment {smallest:.6g} kg m^2"
        yield Finding(kind, where, value, f"{mover} moves it: all moments above 0", MEND_SOLID)


def _massless(measures: Measures, where: str, head: Link, mover: str) -> Finding:
    if head.mass is None:
        value, kind = f"no <inertial>, but {mover} moves it", "no inertial"
    else:
        value, kind = f"mass {head.mass:g} kg, but {mover} moves it", "zero mass"
    file, root = measures.file, trunk_root(measures.file)
    links = [file.link_by_name[name] for name in ([] if root is None else tree_of(file, root))
             if name in file.link_by_name]  # fmt: skip
    known = any((link.mass or 0.0) > 0.0 or measures.body(link) for link in links)
    mend = MEND_MASS if known else "write masses: nothing in the file tells of any"
    return Finding(kind, where, value, "its mass must be above 0", mend, repairable=known)


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
            MEND_MASS,
            "suspicious",
        )
    if solid is not None and (link.mass or 0.0) > rules.DENSEST_LINK * solid.volume:
        yield Finding(
            "too dense",
            where,
            f"mass {link.mass:g} kg for {solid.volume * 1e3:.3g} litres",
            f"at most ten times as dense as osmium ({rules.HEAVIEST:g} kg/m^3)",
            "check its mass and shape: one link alone tells of no unit",
            "suspicious",
            repairable=False,
        )
    if not judged and (text := broken(link)):
        yield Finding(
            "impossible inertia",
            where,
            f"{text}; negligible within its body",
            "positive, and the two smaller ones add up to the largest at least",
            MEND_NEAREST,
            "suspicious",
        )
    if text := misfit(measures, link):
        fits = replaceable(measures, link)
        yield Finding(
            "inertia against size",
            where,
            text,
            "check the unit of its inertia (kg m^2): no body is so large or small",
            MEND_SOLID if fits else CORRECT_SIZE,
            "suspicious",
            repairable=fits,
        )
    if text := off_centre(measures, link):
        yield Finding(
            "centre of mass outside",
            where,
            text,
            "lies within the body",
            "the centre of the link's solid",
            "suspicious",
        )

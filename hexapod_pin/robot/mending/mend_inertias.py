"""Mends of inertias: units, impossible ones, and those that do not fit their link."""

from __future__ import annotations

import math

import numpy as np

from hexapod_pin.robot.description.urdf_file import Link
from hexapod_pin.robot.description.urdf_inertia import (
    INERTIA_RELATIVE_TOLERANCE,
    inertia_matrix,
    principal_moments,
    rotation,
)
from hexapod_pin.robot.mending import rules
from hexapod_pin.robot.mending.draft import Draft, scaled
from hexapod_pin.robot.mending.inertia_findings import broken, misfit, off_centre, replaceable
from hexapod_pin.robot.mending.inertial_element import ENTRIES, write_inertial, write_moments
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.possible_inertia import nearest_possible
from hexapod_pin.robot.mending.units import inertia_slip


def mend_inertias(draft: Draft) -> None:
    """Bring inertias to kg m^2, then mend link by link; masses stay."""
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
            _mend_link(draft, measures, link)
        elif link.mass is not None and not _is_readable(link):
            link.element.remove(link.element.find("inertial"))  # type: ignore[arg-type]
            why = "it has no mass, and missing or non-finite numbers"
            draft.change(f"link {link.name!r}", f"inertial dropped: {why}")


def _mend_link(draft: Draft, measures: Measures, link: Link) -> None:
    """Mend one link with mass: first the moments alone, then, if they do not fit, all of it."""
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
        com = np.array(link.com) if all(map(math.isfinite, link.com)) else np.zeros(3)
        inertia, shape = 0.4 * mass * radius**2 * np.eye(3), f"a ball of radius {radius:.2g} m"
    else:
        com, inertia = body.centre, mass / body.volume * body.inertia
        drawn = measures.solid(link) is not None
        shape = "its hull" if drawn else "a rod or plate between its joints"
    write_inertial(link.element, mass, com, inertia)
    text = f"principal moments {before} -> {_moments(link)} kg m^2 ({why})"
    draft.change(where, text, f"inertia and centre of mass of {shape}, uniform, with its mass")


def _moments(link: Link) -> str:
    """Return the principal moments as text."""
    return ", ".join(f"{value:.3g}" for value in principal_moments(inertia_matrix(link)))

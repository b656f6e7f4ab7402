"""Mending a URDF: every step says what it changes and what it assumes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass

from hexapod_pin.robot.description.urdf_file import Link, UrdfFile, parse_urdf
from hexapod_pin.robot.description.urdf_inertia import inertia_matrix, principal_moments
from hexapod_pin.robot.mending.draft import Draft
from hexapod_pin.robot.mending.link_solids import MeshFinder
from hexapod_pin.robot.mending.mend_appearance import mend_appearance
from hexapod_pin.robot.mending.mend_inertias import mend_inertias
from hexapod_pin.robot.mending.mend_joints import mend_joints
from hexapod_pin.robot.mending.mend_lengths import mend_lengths
from hexapod_pin.robot.mending.mend_limits import mend_limits
from hexapod_pin.robot.mending.mend_masses import mend_masses
from hexapod_pin.robot.mending.mend_names import mend_names
from hexapod_pin.robot.mending.mend_structure import mend_structure
from hexapod_pin.robot.mending.options import MendOptions
from hexapod_pin.robot.mending.statement import mend_statement

Step = Callable[[Draft], None]
STEPS: tuple[Step, ...] = (
    mend_names,
    mend_structure,
    mend_joints,
    mend_appearance,
    mend_lengths,
)
"""Each starts from what the ones before have left."""

STEPS_OF_A_SIZE: tuple[Step, ...] = (mend_masses, mend_inertias, mend_limits)
"""What needs a robot of a possible size: masses need lengths, limits need masses."""

MOST_ROUNDS = 5
"""A repair can show a further fault: a joint made fixed leaves a tree without moved ones."""

Moments = tuple[float, float, float]


@dataclass(frozen=True)
class MassRow:
    """Mass and principal moments of one link.

    Attributes:
        link: its name.
        before: mass [kg]; None without one, or without the link.
        after: the same, mended.
        moments_before: principal moments [kg m^2], ascending; None without a mass.
        moments_after: the same, mended.
    """

    link: str
    before: float | None
    after: float | None
    moments_before: Moments | None
    moments_after: Moments | None


@dataclass(frozen=True)
class Mended:
    """A mended URDF.

    Attributes:
        file: the mended file; the one given, to the byte, where nothing had to be mended.
        changes: what was changed, with before and after, a sentence each.
        assumed: what is now assumed; the file carries these sentences too.
        masses: of every link, before and after.
        notes: options that were not used, and why.
    """

    file: UrdfFile
    changes: tuple[str, ...]
    assumed: tuple[str, ...]
    masses: tuple[MassRow, ...]
    notes: tuple[str, ...] = ()


def mend_urdf(
    file: UrdfFile, finder: MeshFinder | None = None, options: MendOptions | None = None
) -> Mended:
    """Mend what can be mended; `find_all` on the result tells what could not.

    Args:
        file: as read.
        finder: finds meshes, whose hulls give volumes and inertias; None leaves them out.
        options: numbers of the user; None assumes what is missing.
    """
    draft = Draft(file, finder, options or MendOptions())
    for _ in range(MOST_ROUNDS):
        before = draft.changes
        for step in STEPS:
            step(draft)
        if draft.changes == before:
            break
    if draft.measures.plausible_size:
        for step in STEPS_OF_A_SIZE:
            step(draft)
    mend_statement(draft)
    if not draft.changes:
        return Mended(file, (), (), masses(file, file), tuple(draft.notes))
    _write_assumed(draft.root, draft.assumed)
    text = '<?xml version="1.0"?>\n' + ET.tostring(draft.root, encoding="unicode") + "\n"
    mended = parse_urdf(text.encode(), file.source)
    return Mended(mended, draft.changes, draft.assumed, masses(file, mended), tuple(draft.notes))


def masses(before: UrdfFile, after: UrdfFile) -> tuple[MassRow, ...]:
    """Return masses and principal moments of all links of two files."""
    names = dict.fromkeys([*before.link_by_name, *after.link_by_name])
    rows = []
    for name in names:
        old, new = (_numbers(file.link_by_name.get(name)) for file in (before, after))
        rows.append(MassRow(name, old[0], new[0], old[1], new[1]))
    return tuple(rows)


def _numbers(link: Link | None) -> tuple[float | None, Moments | None]:
    if link is None or link.mass is None:
        return None, None
    small, middle, large = (float(x) for x in principal_moments(inertia_matrix(link)))
    return link.mass, (small, middle, large)


def _write_assumed(root: ET.Element, assumed: tuple[str, ...]) -> None:
    """Append the assumptions to <hexapod_pin>, which other parsers ignore."""
    if not assumed:
        return
    own = root.find("hexapod_pin")
    if own is None:
        own = ET.SubElement(root, "hexapod_pin")
        name = root.get("name") or "unnamed"
        own.attrib.update(title=name, source="Mended: see what is assumed")
    for text in assumed:
        ET.SubElement(own, "assumed").text = text
    ET.indent(own)

"""A URDF is repaired in steps, each of which states what it changes and assumes.

Masses before and after the repair are shown in a table.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hexapod_pin.robot.description.solids import inertia_matrix, principal_moments
from hexapod_pin.robot.description.urdf_file import Link, UrdfFile, parse_urdf
from hexapod_pin.robot.repair.appearance import repair_appearance
from hexapod_pin.robot.repair.doubts import grams
from hexapod_pin.robot.repair.find_all import repair_statement
from hexapod_pin.robot.repair.finding import Draft, RepairOptions, places_text
from hexapod_pin.robot.repair.inertias import repair_inertias
from hexapod_pin.robot.repair.joints import repair_joints
from hexapod_pin.robot.repair.like_parts import repair_unlike
from hexapod_pin.robot.repair.limits import repair_limits
from hexapod_pin.robot.repair.masses import repair_masses
from hexapod_pin.robot.repair.measures import MeshFinder
from hexapod_pin.robot.repair.structure import repair_names, repair_structure
from hexapod_pin.robot.repair.units import repair_lengths

Step = Callable[[Draft], None]
STEPS: tuple[Step, ...] = (
    repair_names,
    repair_structure,
    repair_joints,
    repair_appearance,
    repair_lengths,
)
"""Each starts from what the ones before have left."""

STEPS_OF_A_SIZE: tuple[Step, ...] = (repair_unlike, repair_masses, repair_inertias, repair_limits)
"""What needs a robot of a possible size: masses need lengths, limits need masses."""

MOST_ROUNDS = 5
"""A repair can show a further fault: a joint made fixed leaves a tree without moved ones, a torque
limit assumed for one leg is unlike those of the others."""

Moments = tuple[float, float, float]


@dataclass(frozen=True)
class MassRow:
    """Mass and principal moments of one link.

    Attributes:
        link: its name.
        before: mass [kg]; None without one, or without the link.
        after: the same, repaired.
        moments_before: principal moments [kg m^2], ascending; None without a mass.
        moments_after: the same, repaired.
    """

    link: str
    before: float | None
    after: float | None
    moments_before: Moments | None
    moments_after: Moments | None


@dataclass(frozen=True)
class Repaired:
    """A repaired URDF.

    Attributes:
        file: the repaired file; the one given, to the byte, where nothing had to be repaired.
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


def repair_urdf(
    file: UrdfFile, finder: MeshFinder | None = None, options: RepairOptions | None = None
) -> Repaired:
    """Repair what can be repaired; `find_all` on the result gives the rest.

    Args:
        file: as read.
        finder: finds meshes, whose hulls give volumes and inertias; None leaves them out.
        options: numbers of the user; None assumes what is missing.
    """
    draft = Draft(file, finder, options or RepairOptions())
    _repeat(STEPS, draft)
    if draft.measures.plausible_size:
        _repeat(STEPS_OF_A_SIZE, draft)
    repair_statement(draft)
    if not draft.changes:
        return Repaired(file, (), (), masses(file, file), tuple(draft.notes))
    _write_assumed(draft.root, draft.assumed)
    text = '<?xml version="1.0"?>\n' + ET.tostring(draft.root, encoding="unicode") + "\n"
    repaired = parse_urdf(text.encode(), file.source)
    return Repaired(
        repaired, draft.changes, draft.assumed, masses(file, repaired), tuple(draft.notes)
    )


def _repeat(steps: Sequence[Step], draft: Draft) -> None:
    for _ in range(MOST_ROUNDS):
        before = draft.changes
        for step in steps:
            step(draft)
        if draft.changes == before:
            break


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
        own.attrib.update(title=name, source="Repaired: see what is assumed")
    for text in assumed:
        ET.SubElement(own, "assumed").text = text
    ET.indent(own)


# Masses and principal moments before and after a repair, as lines of a table.

HEADER = ("mass", "repaired", "principal moments [kg m^2]", "repaired", "link")


def mass_lines(rows: Sequence[MassRow]) -> list[str]:
    """Return a table of the links whose numbers changed, equal rows in one, and the total."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        numbers = (_mass(row.before), _mass(row.after), _moments(row.moments_before),
                   _moments(row.moments_after))  # fmt: skip
        if numbers[0] != numbers[1] or numbers[2] != numbers[3]:
            groups.setdefault(numbers, []).append(f"link {row.link}")
    table = [HEADER, *((*numbers, places_text(links)) for numbers, links in groups.items())]
    widths = [max(len(line[k]) for line in table) for k in range(len(HEADER) - 1)]
    lines = [
        "  ".join(
            [*(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=False)), line[-1]]
        )
        for line in table
    ]
    before, after = (math.fsum(_known(row, name) for row in rows) for name in ("before", "after"))
    return [*(lines if groups else []), f"total mass {grams(before)} -> {grams(after)}"]


def _known(row: MassRow, name: str) -> float:
    mass = row.before if name == "before" else row.after
    return mass if mass is not None and math.isfinite(mass) else 0.0


def _mass(mass: float | None) -> str:
    return "-" if mass is None else grams(mass)


def _moments(moments: Moments | None) -> str:
    return "-" if moments is None else " ".join(f"{value:.3g}" for value in moments)

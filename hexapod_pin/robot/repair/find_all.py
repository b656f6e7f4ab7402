"""All findings of a URDF are made in one pass.

Statements in <hexapod_pin> that do not fit its links are findings as well.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from hexapod_pin.robot.description.urdf_annotation import ANNOTATION, PLACES, stated_leg_faults
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile, attribute
from hexapod_pin.robot.repair.appearance import appearance_findings
from hexapod_pin.robot.repair.doubts import doubts
from hexapod_pin.robot.repair.finding import Draft, Finding
from hexapod_pin.robot.repair.inertias import inertia_findings
from hexapod_pin.robot.repair.joints import joint_findings
from hexapod_pin.robot.repair.like_parts import unlike_findings
from hexapod_pin.robot.repair.limits import limit_findings
from hexapod_pin.robot.repair.masses import SCALE_FIRST, whole_findings
from hexapod_pin.robot.repair.measures import LinkSolids, Measures, MeshFinder
from hexapod_pin.robot.repair.rules import Severity
from hexapod_pin.robot.repair.structure import structure_findings
from hexapod_pin.robot.repair.units import joint_length_slip


def find_all(file: UrdfFile, finder: MeshFinder | None) -> list[Finding]:
    """Return every fault of a URDF, each with what repairs it; none hides another.

    Args:
        file: as read.
        finder: finds meshes; None leaves them out of the judgement.
    """
    measures = Measures(file, LinkSolids(finder))
    sized = [
        *unlike_findings(measures), *limit_findings(measures), *inertia_findings(measures)
    ]  # fmt: skip
    if not (measures.plausible_size or joint_length_slip(measures)):
        sized = [replace(x, repair=SCALE_FIRST, repairable=False) for x in sized]
    return [
        *structure_findings(file),
        *joint_findings(measures),
        *sized,
        *appearance_findings(measures),
        *whole_findings(measures),
        *(found for found, _ in bad_statements(file)),
    ]


# What makes a URDF unusable (findings) or suspicious (notes), without looking at meshes.


class UrdfCheck(NamedTuple):
    """Findings (the file is refused), notes (it is used) and `doubts`, as sentences."""

    findings: list[str]
    notes: list[str]
    doubts: tuple[str, ...]


def check_urdf(file: UrdfFile) -> UrdfCheck:
    """Check structure, joints, limits and inertias; all findings at once."""
    found = find_all(file, None)
    refused = [str(finding) for finding in found if finding.severity == "refused"]
    notes = [str(finding) for finding in found if finding.severity == "suspicious"]
    return UrdfCheck(refused, [] if refused else notes, () if refused else doubts(found))


# What a URDF states of itself in <hexapod_pin> and does not fit its links: found, and dropped.


class BadStatement(NamedTuple):
    """A finding, and the elements whose removal repairs it."""

    finding: Finding
    elements: tuple[ET.Element, ...]


def bad_statements(file: UrdfFile) -> list[BadStatement]:
    """Return every stated leg, posture and held place that does not fit the links and joints."""
    own = file.root.find(ANNOTATION)
    if own is None:
        return []
    found = [x for tag, place in PLACES.items() for x in _places(file, own, tag, place)]
    legs = tuple(own.findall("leg"))
    for text in stated_leg_faults(file):
        found.append(
            BadStatement(
                Finding(
                    "unusable statement",
                    "robot",
                    text,
                    "each <leg> is a chain of moved joints from the trunk to its foot",
                    "all <leg> are dropped: the legs are searched by their geometry",
                    "suspicious",
                ),
                legs,
            )
        )
    return found


def repair_statement(draft: Draft) -> None:
    """Drop statements that do not fit the file as it is now."""
    own = draft.root.find(ANNOTATION)
    for finding, elements in bad_statements(draft.file):
        for element in elements:
            if own is not None and element in own:
                own.remove(element)
        draft.change(finding.where, f"statement dropped: {finding.value}")


def _places(file: UrdfFile, own: ET.Element, tag: str, name: str) -> Iterator[BadStatement]:
    """Yield the stated places of one kind that no joint can have."""
    moved = {joint.name: joint for joint in file.joints if joint.moves}
    kinds = {joint.name: joint.kind for joint in file.joints}
    for element in own.findall(tag):
        joint, written = element.get("joint") or "", element.get(name)
        place = attribute(element, name, math.nan)
        severity: Severity = "refused"
        if joint in kinds and joint not in moved:
            text = f"<{tag}>: joint {joint!r} is {kinds[joint]}, so it has no {name}"
        elif joint not in moved:
            text = f"<{tag}>: no moved joint {joint!r}"
        elif not math.isfinite(place):
            text = f"<{tag}> joint {joint!r}: {name} {written!r}"
        elif limits := _passed_limits(moved[joint], place):
            severity = "suspicious"  # refused unless the user states another place
            text = f"<{tag}> joint {joint!r}: {name} {written!r}, with {limits}"
        else:
            continue
        finding = Finding(
            "unusable statement",
            f"joint {joint!r}",
            text,
            "a number within the limits of a moved joint",
            f"<{tag}> is dropped: the place is searched",
            severity,
        )
        yield BadStatement(finding, (element,))


def _passed_limits(joint: Joint, place: float) -> str:
    """Return the limits that a place [rad or m] lies outside of; "" where it is within them."""
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    if joint.kind == "continuous" or not lower <= upper or lower <= place <= upper:
        return ""
    return f"limits {lower:g} to {upper:g}"

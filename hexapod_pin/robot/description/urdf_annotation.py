"""What a URDF states of itself in its <hexapod_pin> element, which other parsers ignore.

It states the legs, how the robot stands, and where its numbers come from:

    <hexapod_pin title="..." source="...">
      <leg name="lf" joints="lf_coxa lf_femur lf_tibia" foot="lf_foot"/> ...
      <posture joint="lf_coxa" angle="0.1"/> ...
      <held joint="head_pan" position="0.1"/> ...
      <assumed>...</assumed> ... <inferred>...</inferred> ...
    </hexapod_pin>

Joints whose names have blanks in them are separated by tabs. What is stated goes before what would
be recognised. A joint that no leg walks with is held.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import dataclass
from typing import Literal

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import TURNING, Joint, UrdfFile, attribute

ANNOTATION = "hexapod_pin"
"""Name of the element of a URDF that holds data for this package."""

PLACES = {"posture": "angle", "held": "position"}
"""Elements that state where a joint is, and the attribute with the place."""

MIN_LEGS, MAX_LEGS = 4, 8
"""Legs of a robot that walks."""

MIN_LEG_JOINTS, MAX_LEG_JOINTS = 2, 3
"""Joints with which a leg walks; others between trunk and foot are held."""


@dataclass(frozen=True)
class Provenance:
    """Where a URDF's numbers come from: its own element, or its name and path.

    Attributes:
        line: title and source of the numbers.
        assumed: statements of what is assumed.
        inferred: statements of what was inferred from the geometry.
    """

    line: str
    assumed: tuple[str, ...]
    inferred: tuple[str, ...]


def read_provenance(file: UrdfFile) -> Provenance:
    """Return the statements of a URDF on its numbers."""
    assumed, inferred = (
        tuple((entry.text or "").strip() for entry in _entries(file, tag))
        for tag in ("assumed", "inferred")
    )
    line, element = f"{file.name}: numbers of {file.source}", file.root.find(ANNOTATION)
    if element is not None and element.get("title") is not None:
        line = f"{element.get('title')}. {element.get('source')}"
    return Provenance(line, assumed, inferred)


def _entries(file: UrdfFile, tag: str) -> list[ET.Element]:
    """Return the elements of a kind in the file's annotation."""
    return file.root.findall(f"{ANNOTATION}/{tag}")


def stated_places(file: UrdfFile, tag: Literal["posture", "held"]) -> dict[str, float]:
    """Return joint name -> place [rad, or m of a sliding joint] of the elements of a kind.

    Raises:
        UrdfError: no moved joint of that name, or no finite place; all at once.
    """
    places: dict[str, float] = {}
    findings = []
    moved = {joint.name for joint in file.joints if joint.moves}
    for entry in _entries(file, tag):
        name, place = entry.get("joint") or "", attribute(entry, PLACES[tag], math.nan)
        places[name] = place + 0.0
        if name not in moved:
            findings.append(f"<{tag}>: no moved joint {name!r}")
        elif not math.isfinite(place):
            text = f"{PLACES[tag]} {entry.get(PLACES[tag])!r}"
            findings.append(f"<{tag}> joint {name!r}: {text}; give a number [rad or m]")
    if findings:
        raise UrdfError(file.source, findings)
    return places


StatedLeg = tuple[str, tuple[str, ...], str]
"""Name, joints from the trunk outwards, and foot link of a leg."""


def stated_legs(file: UrdfFile) -> list[StatedLeg]:
    """Return the legs that a file states, unchecked."""
    legs: list[StatedLeg] = []
    for entry in _entries(file, "leg"):
        text = entry.get("joints") or ""
        joints = tuple(text.split("\t") if "\t" in text else text.split())
        legs.append((entry.get("name") or "", joints, entry.get("foot") or ""))
    return legs


def stated_leg_faults(file: UrdfFile) -> list[str]:
    """Return what is wrong with the legs that a file states, a sentence each."""
    legs = stated_legs(file)
    if not legs:
        return []
    found = [text for leg in legs for text in _leg_faults(file, *leg)]
    if not MIN_LEGS <= len(legs) <= MAX_LEGS:
        found.append(f"{len(legs)} <leg> elements; a robot walks on {MIN_LEGS} to {MAX_LEGS} legs")
    names, joints, feet = zip(*legs, strict=True)
    parts = {"leg": names, "foot": feet, "joint": [name for leg in joints for name in leg]}
    for kind, members in parts.items():
        twice = [name for name, count in Counter(members).items() if count > 1]
        found += [f"<leg>: {kind} {name!r} stated more than once" for name in twice]
    return found


def _leg_faults(file: UrdfFile, leg: str, joints: tuple[str, ...], foot: str) -> list[str]:
    """Return what is wrong with one stated leg."""
    where = f"<leg name={leg!r}>"
    found = [] if leg else [f"{where}: has no name"]
    if not MIN_LEG_JOINTS <= len(joints) <= MAX_LEG_JOINTS:
        text = f"{where}: {len(joints)} joints; a leg walks with 2 or 3, state others as <held>"
        found.append(text)
    if foot not in file.link_by_name:
        return [*found, f"{where}: no foot link {foot!r}"]
    above = moved_joints_above(file, foot)
    names = [joint.name for joint in above]
    if [name for name in names if name in joints] != list(joints):
        text = f"joints {' '.join(joints)} are not in this order among those that move"
        found.append(f"{where}: {text} foot {foot!r}: {' '.join(names) or 'none'}")
    slides = [x.name for x in above if x.name in joints and x.kind not in TURNING]
    found += [f"{where}: joint {name!r} does not turn; state it as <held>" for name in slides]
    return found


def moved_joints_above(file: UrdfFile, link: str) -> list[Joint]:
    """Return the moved joints between the base and a link, from the base outwards."""
    by_child = {joint.child: joint for joint in file.joints}
    above: list[Joint] = []
    while link in by_child:
        joint = by_child.pop(link)  # each once, also where they form a loop
        above += [joint] if joint.moves else []
        link = joint.parent
    return above[::-1]

"""Legs and held joints that a URDF states itself, in its <hexapod_pin> element.

```xml
<hexapod_pin>
  <leg name="lf" joints="lf_coxa lf_femur lf_tibia" foot="lf_foot"/> ...
  <held joint="head_pan" position="0.1"/> ...
</hexapod_pin>
```
Joints whose names have blanks in them are separated by tabs.
What is stated goes before every search by names. A joint that no leg walks with is held.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from xml.etree.ElementTree import Element

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile, attribute
from hexapod_pin.robot.loading.limbs import TURNING, Leg, Limbs

MIN_LEGS, MAX_LEGS = 4, 8
"""Legs of a robot that walks."""

MIN_LEG_JOINTS, MAX_LEG_JOINTS = 2, 3
"""Joints with which a leg walks; others between trunk and foot are held."""


def stated_limbs(file: UrdfFile, feet: Sequence[str] | None = None) -> Limbs | None:
    """Return the legs that a file states, None where it states none.

    Args:
        file: a URDF without findings.
        feet: foot links as given by the user; they must be the stated ones.

    Returns:
        Legs in the file's order; six legs named as in `LEG_NAMES` in that order.

    Raises:
        UrdfError: an element names what does not exist or no chain from the trunk to the foot, a
            joint serves twice, the count is not 4 to 8, or other feet are given; all at once.
    """
    legs = _stated(file)
    if not legs:
        return None
    findings = stated_leg_faults(file)
    stated = [leg.foot for leg in legs]
    if feet is not None and sorted(feet) != sorted(stated):
        findings.append(f"feet {list(feet)}: the file states {stated}; give these, or none")
    if findings:
        raise UrdfError(file.source, findings)
    if sorted(leg.name for leg in legs) == sorted(LEG_NAMES):
        legs.sort(key=lambda leg: LEG_NAMES.index(leg.name))
    return Limbs(tuple(legs), tuple(leg.foot for leg in legs))


def stated_leg_faults(file: UrdfFile) -> list[str]:
    """Return what is wrong with the legs that a file states, a sentence each."""
    legs = _stated(file)
    found = [text for leg in legs for text in _leg_findings(file, leg)]
    return found + (_count_findings(legs) if legs else [])


def _stated(file: UrdfFile) -> list[Leg]:
    """Return the legs that a file states, unchecked."""
    element = file.root.find("hexapod_pin")
    return [] if element is None else [_leg(entry) for entry in element.findall("leg")]


def stated_places(file: UrdfFile) -> dict[str, float]:
    """Return joint name -> place [rad, or m of a sliding joint] of the <held> elements.

    Raises:
        UrdfError: no moved joint of that name, or no finite place; all at once.
    """
    element = file.root.find("hexapod_pin")
    places: dict[str, float] = {}
    findings = []
    moved = {joint.name for joint in file.joints if joint.moves}
    for entry in [] if element is None else element.findall("held"):
        name, place = entry.get("joint") or "", attribute(entry, "position", math.nan)
        places[name] = place
        if name not in moved:
            findings.append(f"<held>: no moved joint {name!r}")
        elif not math.isfinite(place):
            text = entry.get("position")
            findings.append(f"<held> joint {name!r}: position {text!r}; give a number [rad or m]")
    if findings:
        raise UrdfError(file.source, findings)
    return places


def _leg(entry: Element) -> Leg:
    """Return the leg of an element, unchecked."""
    text = entry.get("joints") or ""
    joints = tuple(text.split("\t") if "\t" in text else text.split())
    return Leg(entry.get("name") or "", joints, entry.get("foot") or "")


def _leg_findings(file: UrdfFile, leg: Leg) -> list[str]:
    """Return what is wrong with one stated leg."""
    where = f"<leg name={leg.name!r}>"
    found = [] if leg.name else [f"{where}: has no name"]
    if not MIN_LEG_JOINTS <= len(leg.joints) <= MAX_LEG_JOINTS:
        text = f"{where}: {len(leg.joints)} joints; a leg walks with 2 or 3, state others as <held>"
        found.append(text)
    if leg.foot not in file.link_by_name:
        return [*found, f"{where}: no foot link {leg.foot!r}"]
    above = moved_joints_above(file, leg.foot)
    names = [joint.name for joint in above]
    if [name for name in names if name in leg.joints] != list(leg.joints):
        text = f"joints {' '.join(leg.joints)} are not in this order among those that move"
        found.append(f"{where}: {text} foot {leg.foot!r}: {' '.join(names) or 'none'}")
    slides = [x.name for x in above if x.name in leg.joints and x.kind not in TURNING]
    found += [f"{where}: joint {name!r} does not turn; state it as <held>" for name in slides]
    return found


def _count_findings(legs: Sequence[Leg]) -> list[str]:
    """Return what is wrong with the legs together."""
    found = []
    if not MIN_LEGS <= len(legs) <= MAX_LEGS:
        found.append(f"{len(legs)} <leg> elements; a robot walks on {MIN_LEGS} to {MAX_LEGS} legs")
    parts = {
        "leg": [leg.name for leg in legs],
        "foot": [leg.foot for leg in legs],
        "joint": [joint for leg in legs for joint in leg.joints],
    }
    for kind, names in parts.items():
        twice = [name for name, count in Counter(names).items() if count > 1]
        found += [f"<leg>: {kind} {name!r} stated more than once" for name in twice]
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

"""Where a URDF's numbers come from: its own <hexapod_pin> element, or its name and path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, attribute


@dataclass(frozen=True)
class Provenance:
    """What a URDF says about itself.

    Attributes:
        line: title and source of the numbers.
        assumed: statements of what is assumed.
        inferred: statements of what was inferred from the geometry.
        posture: standing angles by joint name [rad]; empty where the file gives none.
    """

    line: str
    assumed: tuple[str, ...]
    posture: Mapping[str, float]
    inferred: tuple[str, ...] = ()


def read_provenance(file: UrdfFile) -> Provenance:
    """Read the <hexapod_pin> element; other parsers ignore it.

    Raises:
        UrdfError: a <posture> names no moved joint or has no finite angle.
    """
    element = file.root.find("hexapod_pin")
    if element is None:
        return Provenance(f"{file.name}: numbers of {file.source}", (), {})
    moved = {joint.name for joint in file.joints if joint.moves}
    posture, findings = {}, []
    for entry in element.findall("posture"):
        name, angle = entry.get("joint") or "", attribute(entry, "angle", math.nan)
        posture[name] = angle
        if name not in moved:
            findings.append(f"<posture>: no moved joint {name!r}")
        elif not math.isfinite(angle):
            findings.append(f"<posture> of joint {name!r}: angle {entry.get('angle')!r} rad")
    if findings:
        raise UrdfError(file.source, findings)
    assumed, inferred = (
        tuple((entry.text or "").strip() for entry in element.findall(tag))
        for tag in ("assumed", "inferred")
    )
    line = f"{file.name}: numbers of {file.source}"
    if element.get("title") is not None:
        line = f"{element.get('title')}. {element.get('source')}"
    return Provenance(line, assumed, posture, inferred)

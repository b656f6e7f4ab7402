"""What makes a URDF unusable (findings) or suspicious (notes), without looking at meshes."""

from __future__ import annotations

from typing import NamedTuple

from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.mending.find_all import find_all


class UrdfCheck(NamedTuple):
    """Findings (the file is refused) and notes (it is used), as sentences."""

    findings: list[str]
    notes: list[str]


def check_urdf(file: UrdfFile) -> UrdfCheck:
    """Check structure, joints, limits and inertias; all findings at once."""
    found = find_all(file, None)
    refused = [str(finding) for finding in found if finding.severity == "refused"]
    notes = [str(finding) for finding in found if finding.severity == "suspicious"]
    return UrdfCheck(refused, [] if refused else notes)

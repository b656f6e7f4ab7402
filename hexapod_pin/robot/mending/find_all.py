"""All findings of a URDF in one pass."""

from __future__ import annotations

from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.mending.appearance_findings import appearance_findings
from hexapod_pin.robot.mending.finding import Finding
from hexapod_pin.robot.mending.inertia_findings import inertia_findings
from hexapod_pin.robot.mending.joint_findings import joint_findings
from hexapod_pin.robot.mending.limit_findings import limit_findings
from hexapod_pin.robot.mending.link_solids import LinkSolids, MeshFinder
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.structure_findings import structure_findings
from hexapod_pin.robot.mending.whole_findings import whole_findings


def find_all(file: UrdfFile, finder: MeshFinder | None) -> list[Finding]:
    """Return every trouble of a URDF; trouble of one kind hides none of another.

    Args:
        file: as read.
        finder: finds meshes; None leaves them out of the judgement.
    """
    measures = Measures(file, LinkSolids(finder))
    return [
        *structure_findings(file),
        *joint_findings(file),
        *limit_findings(measures),
        *inertia_findings(measures),
        *appearance_findings(measures),
        *whole_findings(measures),
    ]

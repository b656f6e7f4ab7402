"""All findings of a URDF in one pass."""

from __future__ import annotations

from dataclasses import replace

from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.mending.appearance_findings import appearance_findings
from hexapod_pin.robot.mending.finding import Finding
from hexapod_pin.robot.mending.inertia_findings import inertia_findings
from hexapod_pin.robot.mending.joint_findings import joint_findings
from hexapod_pin.robot.mending.limit_findings import limit_findings
from hexapod_pin.robot.mending.link_solids import LinkSolids, MeshFinder
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.statement import bad_statements
from hexapod_pin.robot.mending.structure_findings import structure_findings
from hexapod_pin.robot.mending.units import joint_length_slip
from hexapod_pin.robot.mending.whole_findings import SCALE_FIRST, whole_findings


def find_all(file: UrdfFile, finder: MeshFinder | None) -> list[Finding]:
    """Return every fault of a URDF, each with what repairs it; none hides another.

    Args:
        file: as read.
        finder: finds meshes; None leaves them out of the judgement.
    """
    measures = Measures(file, LinkSolids(finder))
    sized = [*limit_findings(measures), *inertia_findings(measures)]
    if not (measures.plausible_size or joint_length_slip(measures)):
        sized = [replace(x, mend=SCALE_FIRST, repairable=False) for x in sized]
    return [
        *structure_findings(file),
        *joint_findings(measures),
        *sized,
        *appearance_findings(measures),
        *whole_findings(measures),
        *(found for found, _ in bad_statements(file)),
    ]

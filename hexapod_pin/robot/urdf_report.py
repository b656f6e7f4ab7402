"""What is in a URDF and whether it can be used, as a report to read; nothing is simulated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, read_urdf
from hexapod_pin.robot.loading.limbs import Leg, leg_chains
from hexapod_pin.robot.mending.structure_findings import structure_findings
from hexapod_pin.robot.robot import PACKAGED, Robot, load_robot, urdf_path


@dataclass(frozen=True)
class UrdfReport:
    """The content of a URDF.

    Attributes:
        source: path of the file.
        name: name of the robot.
        links: number of links.
        joints: number of joints, fixed ones included.
        moved_joints: number of joints that move.
        total_mass: sum of all masses [kg]; NaN where one is not a number.
        chains: number of unbranched chains of three moved joints from the base.
        legs: the six legs; empty where the file is refused or the robot is no hexapod.
        feet: foot links with the radius of their spheres [m].
        assumed: what the file says is assumed.
        findings: why the file is refused; empty where it is accepted.
        notes: what the loader drops, changes or finds suspicious.
    """

    source: str
    name: str
    links: int
    joints: int
    moved_joints: int
    total_mass: float
    chains: int
    legs: tuple[Leg, ...]
    feet: tuple[tuple[str, float], ...]
    assumed: tuple[str, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether the file can be used."""
        return not self.findings

    def __str__(self) -> str:
        """Return the report as lines of text."""
        lines = [
            f"{self.name} ({self.source})",
            f"{self.links} links, {self.joints} joints ({self.moved_joints} move),"
            f" {self.total_mass:.6g} kg, {self.chains} three-joint legs",
            *(f"leg {leg.name}: {', '.join(leg.joints)}; foot {leg.foot}" for leg in self.legs),
            *(f"foot {name}: sphere of radius {radius:g} m" for name, radius in self.feet),
            *(f"assumed: {text}" for text in self.assumed),
            *(f"note: {text}" for text in self.notes),
            *(f"REFUSED: {text}" for text in self.findings),
            *(["accepted"] if self.ok else []),
        ]
        return "\n".join(lines)


def inspect(source: str | Path, *, feet: Sequence[str] | None = None) -> UrdfReport:
    """Report on a packaged robot or a URDF without raising for what is wrong inside it.

    Args:
        source: name of a packaged robot or path of a URDF.
        feet: as in `load_robot`.

    Raises:
        UrdfError: the file is missing or is not a URDF at all.
        UnknownNameError: a foot that is no link of a sound file.
    """
    path = urdf_path(str(source)) if source in PACKAGED else Path(source)
    file = read_urdf(path)
    try:
        robot = load_robot(path, feet=feet)
    except UrdfError as error:
        return _report(file, None, error.findings)
    except ParameterError as error:
        return _report(file, None, [str(error)])
    return _report(file, robot, [])


def _report(file: UrdfFile, robot: Robot | None, findings: list[str]) -> UrdfReport:
    """Collect the report; of a refused file only what can be counted."""
    masses = [link.mass for link in file.links if link.mass is not None]
    chains = [] if structure_findings(file) else leg_chains(file)[0]
    return UrdfReport(
        source=file.source, name=file.name, links=len(file.links), joints=len(file.joints),
        moved_joints=sum(joint.moves for joint in file.joints),
        total_mass=math.fsum(masses) if all(map(math.isfinite, masses)) else math.nan,
        chains=len(chains), legs=robot.legs if robot else (),
        feet=tuple((foot.name, foot.radius) for foot in robot.feet) if robot else (),
        assumed=robot.assumed if robot else (), findings=tuple(findings),
        notes=robot.notes if robot else (),
    )  # fmt: skip

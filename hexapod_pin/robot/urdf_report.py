"""What is in a URDF and whether it can be used, as a report to read; nothing is simulated."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, read_urdf
from hexapod_pin.robot.loading.limbs import Leg
from hexapod_pin.robot.mending.find_all import find_all
from hexapod_pin.robot.mending.finding import Finding
from hexapod_pin.robot.mending.finding_lines import finding_lines
from hexapod_pin.robot.mending.link_solids import LinkSolids
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.urdf_check import check_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
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
        chains: number of moved joints of every unbranched chain from the trunk, head and arms
            included.
        legs: the six legs; empty where the file is refused or the robot is no hexapod.
        feet: foot links with the radius of their spheres [m].
        assumed: what the file says is assumed.
        found: every trouble of the file, those that refuse it and those that are suspicious.
        findings: why the file is refused, a sentence each; empty where it is accepted.
        notes: what the loader drops or changes.
    """

    source: str
    name: str
    links: int
    joints: int
    moved_joints: int
    total_mass: float
    chains: tuple[int, ...]
    legs: tuple[Leg, ...]
    feet: tuple[tuple[str, float], ...]
    assumed: tuple[str, ...]
    found: tuple[Finding, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether the file can be used."""
        return not self.findings

    @property
    def refusals(self) -> tuple[str, ...]:
        """Why the file is refused, where no finding says it: feet, posture, what is stated."""
        said = {str(finding) for finding in self.found}
        return tuple(text for text in self.findings if text not in said)

    def __str__(self) -> str:
        """Return the report as lines of text."""
        lines = [
            f"{self.name} ({self.source})",
            f"{self.links} links, {self.joints} joints ({self.moved_joints} move),"
            f" {self.total_mass:.6g} kg, {chains_text(self.chains)}",
            *recognised_lines(self),
            *(f"assumed: {text}" for text in self.assumed),
            *(f"note: {text}" for text in self.notes),
            *finding_lines(self.found),
            *(f"REFUSED: {text}" for text in self.refusals),
            "accepted" if self.ok else "refused: see `hexapod-pin mend` for what a mend does",
        ]
        return "\n".join(lines)


def recognised_lines(report: UrdfReport) -> list[str]:
    """Return the legs and feet that were found."""
    return [
        *(f"leg {leg.name}: {', '.join(leg.joints)}; foot {leg.foot}" for leg in report.legs),
        *(f"foot {name}: sphere of radius {radius:g} m" for name, radius in report.feet),
    ]


def chains_text(chains: Sequence[int]) -> str:
    """Return the chains of moved joints by their number of joints, longest first."""
    counts = sorted(Counter(chains).items(), reverse=True)
    texts = [f"{count} of {joints}" for joints, count in counts]
    return f"chains of moved joints: {', '.join(texts) or 'none'}"


def inspect(
    source: str | Path,
    *,
    feet: Sequence[str] | None = None,
    package_path: Sequence[str | Path] = (),
) -> UrdfReport:
    """Report on a packaged robot or a URDF without raising for what is wrong inside it.

    Args:
        source: name of a packaged robot or path of a URDF.
        feet: as in `load_robot`.
        package_path: folders in which packages and meshes are looked for first.

    Raises:
        UrdfError: the file is missing or is not a URDF at all.
        UnknownNameError: a foot that is no link of a sound file.
    """
    path = urdf_path(str(source)) if source in PACKAGED else Path(source)
    file = read_urdf(path)
    finder = ResourceFinder(path, package_path)
    try:
        robot = load_robot(path, feet=feet)
    except UrdfError as error:
        return _report(file, finder, None, error.findings)
    except ParameterError as error:
        return _report(file, finder, None, [str(error)])
    return _report(file, finder, robot, [])


def _report(
    file: UrdfFile, finder: ResourceFinder, robot: Robot | None, findings: list[str]
) -> UrdfReport:
    """Collect the report; of a refused file only what can be counted."""
    masses = [link.mass for link in file.links if link.mass is not None]
    checked = check_urdf(file).notes
    return UrdfReport(
        source=file.source, name=file.name, links=len(file.links), joints=len(file.joints),
        moved_joints=sum(joint.moves for joint in file.joints),
        total_mass=math.fsum(masses) if all(map(math.isfinite, masses)) else math.nan,
        chains=tuple(len(chain) for chain in Measures(file, LinkSolids(None)).chains),
        legs=robot.legs if robot else (),
        feet=tuple((foot.name, foot.radius) for foot in robot.feet) if robot else (),
        assumed=robot.assumed if robot else (), found=tuple(find_all(file, finder)),
        findings=tuple(findings),
        notes=tuple(text for text in robot.notes if text not in checked) if robot else (),
    )  # fmt: skip

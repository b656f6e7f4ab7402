"""What is in a URDF and whether it can be used, as a report to read; nothing is simulated."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.loading.load_options import LoadOptions, read_hints
from hexapod_pin.robot.loading.load_urdf import SourceFile, loaded, read_file
from hexapod_pin.robot.recognition.layout import RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.repair.find_all import check_urdf, find_all
from hexapod_pin.robot.repair.finding import Finding, finding_lines, places_text
from hexapod_pin.robot.repair.measures import LinkSolids, Measures
from hexapod_pin.robot.robot import Leg, Robot, robot_of
from hexapod_pin.robot.robot_source import robot_path


@dataclass(frozen=True)
class UrdfReport(Immutable):
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
        legs: the legs; empty where none can be found or the robot has none.
        feet: foot links with the radius of their spheres [m].
        layout: what was found beside the file's text; None where nothing can be.
        assumed: statements of the file on what is assumed.
        found: every trouble of the file, those that refuse it and those that are suspicious.
        findings: why the file is refused, a sentence each; empty where it is accepted.
        notes: what the loader drops or changes.
        left: of a refused file, why it would be refused after a repair too; empty where a repair
            makes it usable.
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
    layout: RobotLayout | None
    assumed: tuple[str, ...]
    found: tuple[Finding, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    left: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the file can be used."""
        return not self.findings

    @property
    def refusals(self) -> tuple[str, ...]:
        """Reasons for a refusal that are not in `found`: feet, posture, what is stated."""
        known = {str(finding) for finding in self.found}
        return tuple(text for text in self.findings if text not in known)

    def __str__(self) -> str:
        """Return the report as lines of text."""
        lines = [
            f"{self.name}: {self.verdict}",
            f"file {self.source}",
            f"{self.links} links, {self.joints} joints ({self.moved_joints} move),"
            f" {self.total_mass:.6g} kg, {chains_text(self.chains)}",
            *recognised_lines(self),
            *(f"assumed: {text}" for text in self.assumed),
            *(f"note: {text}" for text in self.notes),
            *finding_lines(self.found),
            *(f"REFUSED: {text}" for text in folded_texts(self.refusals)),
        ]
        return "\n".join(lines)

    @property
    def verdict(self) -> str:
        """Whether the file can be used and, where it cannot, whether a repair changes that."""
        if self.ok:
            doubtful = _kinds(one for one in self.found if one.severity != "refused")
            return f"accepted; suspicious: {doubtful}" if doubtful else "accepted"
        refusing = _kinds(one for one in self.found if one.severity == "refused")
        why = "; ".join(filter(None, (refusing, *folded_texts(self.refusals, MOST_PARTS))))
        if not self.left:
            return f"refused: {why}; `hexapod-pin repair` repairs it"
        if self.left == self.findings:
            return f"refused: {why}; no repair changes that"
        left = "; ".join(folded_texts(self.left, MOST_PARTS))
        return f"refused: {why}; a repair would leave this: {left}"

    @property
    def refused_lines(self) -> list[str]:
        """Why the file is refused, as lines of text; empty where it is accepted."""
        return [
            *finding_lines(one for one in self.found if one.severity == "refused"),
            *(f"REFUSED: {text}" for text in folded_texts(self.refusals)),
        ]


MOST_PARTS = 3
"""Parts that the verdict names for one fault."""


def _kinds(findings: Iterable[Finding]) -> str:
    """Return the kinds of findings, each with the number of its places."""
    counts = Counter(one.what for one in findings)
    return ", ".join(f"{kind} ({n})" if n > 1 else kind for kind, n in counts.most_common())


def recognised_lines(report: UrdfReport) -> list[str]:
    """Return the legs and feet that were found, and what was inferred from what."""
    layout = report.layout
    held = {} if layout is None else layout.held
    return [
        *(f"leg {leg.name}: {', '.join(leg.joints)}; foot {leg.foot}" for leg in report.legs),
        *(f"foot {name}: sphere of radius {radius:g} m" for name, radius in report.feet),
        *(f"held: {name} at {place:.4g} rad (m where it slides)" for name, place in held.items()),
        *(f"inferred: {text}" for text in (() if layout is None else layout.inferred)),
    ]


def folded_texts(texts: Sequence[str], most: int | None = None) -> list[str]:
    """Return sentences "part: fault", those of several parts with the same fault as one.

    Args:
        texts: the sentences.
        most: parts that are named for one fault; None: all.
    """
    places: dict[str, list[str]] = {}
    for text in texts:
        place, separator, fault = text.partition(": ")
        places.setdefault(fault if separator else text, []).append(place if separator else "")
    return [f"{places_text(parts, most)}: {fault}" if any(parts) else fault
            for fault, parts in places.items()]  # fmt: skip


def chains_text(chains: Sequence[int]) -> str:
    """Return the chains of moved joints by their number of joints, longest first."""
    counts = sorted(Counter(chains).items(), reverse=True)
    texts = [f"{count} of {joints}" for joints, count in counts]
    return f"chains of moved joints: {', '.join(texts) or 'none'}"


@checked
def inspect(
    source: str | Path,
    *,
    feet: Sequence[str] | None = None,
    options: LoadOptions | None = None,
) -> UrdfReport:
    """Report on a packaged robot or a URDF without raising for what is wrong inside it.

    What can be found of the robot is reported also where the file is refused.

    Args:
        source: name of a packaged robot or path of a URDF or xacro file.
        feet: as in `load_robot`.
        options: as in `load_robot`; nothing is repaired.

    Raises:
        UrdfError: the file is missing or is not a URDF at all.
        UnknownNameError: a hint names no link or joint of a sound file.
        ParameterError: a hints file that cannot be read.
    """
    path = robot_path(source)
    arguments = LoadOptions(feet=None if feet is None else tuple(feet))
    arguments = arguments if options is None else arguments.over(options)
    given = arguments.over(read_hints(path)).model_copy(update={"repair": False})
    read = read_file(path, given)
    report = judged(read, given)
    return report if report.ok else replace(report, left=_left(read, given))


def judged(read: SourceFile, options: LoadOptions) -> UrdfReport:
    """Report on a URDF as it was read, whether by `check` or as what `repair` is about to write.

    Raises:
        UnknownNameError: a hint names no link or joint of a sound file.
    """
    file, finder, *_ = read
    found, layout, robot = find_all(file, finder), None, None
    findings = [str(one) for one in found if one.severity == "refused"]
    sound = not findings
    try:
        layout = recognise(file, finder, options)
        if sound:
            robot = robot_of(loaded(read, options, layout), file.source)
    except UrdfError as error:
        findings += [text for text in error.findings if text not in findings]
    except (ParameterError, UnknownNameError) as error:
        if isinstance(error, UnknownNameError) and sound:
            raise
        findings.append(str(error))
    return _report(file, found, robot, layout, findings)


def _left(read: SourceFile, options: LoadOptions) -> tuple[str, ...]:
    """Return why a refused file would be refused after a repair too; empty where it would not."""
    from hexapod_pin.robot.repair.repair_urdf import repair_urdf

    repaired = repair_urdf(read.file, read.finder)
    try:
        report = judged(read._replace(file=repaired.file), options)
    except UnknownNameError as error:
        return (str(error),)
    return report.findings


def _report(
    file: UrdfFile,
    found: Sequence[Finding],
    robot: Robot | None,
    layout: RobotLayout | None,
    findings: Sequence[str],
) -> UrdfReport:
    """Collect the report; of a refused file what can be counted and recognised."""
    checked = check_urdf(file).notes if robot is not None else []
    masses = [link.mass for link in file.links if link.mass is not None]
    legs = () if layout is None else layout.legs
    feet = [(leg.foot, leg.radius) for leg in legs]
    if robot is not None:
        feet = [(foot.name, foot.radius) for foot in robot.feet]
    return UrdfReport(
        source=file.source, name=file.name, links=len(file.links), joints=len(file.joints),
        moved_joints=sum(joint.moves for joint in file.joints),
        total_mass=math.fsum(masses) if all(map(math.isfinite, masses)) else math.nan,
        chains=tuple(len(chain) for chain in Measures(file, LinkSolids(None)).chains),
        legs=robot.legs if robot else tuple(Leg(x.name, x.joints, x.foot) for x in legs),
        feet=tuple(feet), layout=layout,
        assumed=robot.assumed if robot else (), found=tuple(found),
        findings=tuple(findings),
        notes=tuple(text for text in robot.notes if text not in checked) if robot else (),
    )  # fmt: skip

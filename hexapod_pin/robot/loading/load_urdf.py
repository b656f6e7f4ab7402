"""A robot's file is read, repaired on request, checked, recognised and annotated, each once."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from hexapod_pin.errors import HexapodError, ParameterError, UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.loading.backlash import with_backlash
from hexapod_pin.robot.loading.load_options import LoadOptions, forward_hint, read_hints
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.robot_text import read_robot_text
from hexapod_pin.robot.recognition.feet import GUESSED
from hexapod_pin.robot.recognition.layout import (
    RobotLayout,
    annotate_urdf,
    layout_named,
    layout_of_feet,
    layout_stated,
)
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.repair.find_all import check_urdf
from hexapod_pin.robot.repair.measures import LinkSolids, Measures
from hexapod_pin.robot.repair.units import mesh_slips


class LoadedUrdf(NamedTuple):
    """A robot's file as it is used.

    Attributes:
        file: the URDF with its layout stated in it.
        layout: the robot in it.
        options: how it was read, hints included.
        repaired: what was changed to repair it.
        notes: what was assumed in reading it, and what is suspicious in it.
        doubts: of what is suspicious, what makes torques doubtful, in short phrases.
    """

    file: UrdfFile
    layout: RobotLayout
    options: LoadOptions
    repaired: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def load_urdf(path: Path, options: LoadOptions) -> LoadedUrdf:
    """Read a robot's file, repair it on request, check it, recognise the robot, annotate the file.

    Args:
        path: of a URDF or xacro file; its hints file adds to the options.
        options: how it is read, and what goes before what would be inferred.

    Raises:
        UrdfError: the file cannot be used; all findings at once.
        ParameterError: a hint out of range.
        UnknownNameError: a hint names no link or joint.
    """
    options = options.over(read_hints(path))
    return loaded(read_file(path, options), options)


def loaded(read: SourceFile, options: LoadOptions, layout: RobotLayout | None = None) -> LoadedUrdf:
    """Return a robot's file, as read, as it is used; `layout` if it is known; as `load_urdf`."""
    file, finder, _, notes = read
    repaired: tuple[str, ...] = ()
    if options.repair:
        from hexapod_pin.robot.repair.finding import RepairOptions
        from hexapod_pin.robot.repair.repair_urdf import repair_urdf

        numbers = {name: getattr(options, name) for name in RepairOptions.model_fields}
        done = repair_urdf(file, finder, RepairOptions(**numbers))
        file, repaired = done.file, done.changes
        notes = (*notes, *done.notes)
    findings, suspicious, doubts = check_urdf(file)
    if findings:
        endless = all("continuous joint" in text for text in findings)
        more = _unrecognised(file, finder, options) if endless else []
        raise UrdfError(file.source, [*findings, *more])
    _require_feet_of_a_size(file, options)
    if layout is None:
        layout = _recognised(file, finder, options, doubts)
    sides = _odd_sides(layout)
    for doubt in (_mesh_unit(file, finder, layout), _guessed_feet(layout), sides):
        doubts = doubts if not doubt or doubt in doubts else (doubt, *doubts)
    notes = (*notes, *suspicious, *([sides] if sides else []))
    file = annotate_urdf(file, layout)
    if options.backlash:
        file, layout = with_backlash(file, layout, options.backlash)
    return LoadedUrdf(file, layout, options, repaired, notes, doubts)


def loaded_text(text: str, source: str, options: LoadOptions) -> LoadedUrdf:
    """Return the text of a loaded robot, `Robot.urdf`, as it is used: nothing is recognised.

    Raises:
        UrdfError: the text cannot be used, or states neither legs nor feet.
        UnknownNameError: a hint names no link or joint.
    """
    file = parse_urdf(text.encode(), source)
    findings, suspicious, doubts = check_urdf(file)
    if findings:
        raise UrdfError(source, findings)
    layout = layout_stated(file, options) or layout_named(file, options)
    layout = layout or layout_of_feet(file, options)
    return LoadedUrdf(file, layout, options, (), tuple(suspicious), doubts)


def _recognised(
    file: UrdfFile, finder: ResourceFinder, options: LoadOptions, doubts: tuple[str, ...]
) -> RobotLayout:
    """Return what is recognised of a robot.

    Raises:
        UrdfError: nothing can be; what is doubtful in the file comes first, it may be why.
    """
    try:
        return recognise(file, finder, options)
    except UrdfError as error:
        slips = mesh_slips(Measures(file, LinkSolids(finder))).values()
        found = dict.fromkeys([*doubts, *(f"meshes look like {x.unit}" for x in slips)])
        if not found:
            raise
        raise UrdfError(error.source, [*found, *error.findings]) from error


FAR = 2.0
"""Distance of a foot from the last joint of its leg over the span of all joints, from which meshes
are doubted (*assumed*): robots have 0.1 to 0.5."""


def _mesh_unit(file: UrdfFile, finder: ResourceFinder, layout: RobotLayout) -> str:
    """Return the doubt that meshes, by which feet were found, are in another unit; else nothing."""
    span = Measures(file, LinkSolids(None)).span
    far = max((float(np.linalg.norm(leg.centre)) for leg in layout.legs), default=0.0)
    if not 0.0 < FAR * span < far:
        return ""
    slips = mesh_slips(Measures(file, LinkSolids(finder))).values()
    return next((f"meshes look like {slip.unit}, not SI units" for slip in slips), "")


def _guessed_feet(layout: RobotLayout) -> str:
    """Return the doubt that feet are guessed, as the meshes of their links are not found."""
    count = sum(f"{GUESSED}: " in text for text in layout.inferred)
    return "feet are guessed: their meshes are not found (--package-path)" if count else ""


def _odd_sides(layout: RobotLayout) -> str:
    """Return the doubt about left and right legs, with the option that takes them as they are."""
    if not layout.doubt:
        return ""
    return f"{layout.doubt} (--forward={forward_hint(layout.turn)} takes it as it is)"


def _require_feet_of_a_size(file: UrdfFile, options: LoadOptions) -> None:
    """Refuse feet that are larger than the robot.

    Raises:
        ParameterError: the radius that is given for all feet exceeds half the span of the joints.
    """
    radius = options.foot_radius
    most = 0.5 * Measures(file, LinkSolids(None)).span if radius else 0.0
    if radius and radius > most > 0.0:
        allowed = f"at most {most:.3g} m, half of what the joints span"
        raise ParameterError(
            "foot_radius", radius, allowed, f"mm? {radius:g} mm are {1e-3 * radius:g} m."
        )


def _unrecognised(file: UrdfFile, finder: ResourceFinder, options: LoadOptions) -> list[str]:
    """Return why a robot that only turns endlessly is none that walks: else nothing is added."""
    try:
        recognise(file, finder, options)
    except UrdfError as error:
        return error.findings
    except HexapodError:
        return []
    return []


class SourceFile(NamedTuple):
    """A robot's file as a URDF, where its meshes are looked for, whether xacro made it, notes."""

    file: UrdfFile
    finder: ResourceFinder
    expanded: bool
    notes: tuple[str, ...]


def read_file(path: Path, options: LoadOptions) -> SourceFile:
    """Read a URDF or expand a xacro file.

    Raises:
        UrdfError: the file is missing, too large, no URDF, or xacro that cannot be expanded.
    """
    folders = [Path(folder) for folder in options.package_path]
    read = read_robot_text(path, xacro_args=options.xacro_args, package_path=folders)
    file, finder = parse_urdf(read.text.encode(), str(path)), ResourceFinder(path, folders)
    return SourceFile(file, finder, read.expanded, read.notes)

"""From a robot's file to a URDF that says everything: read, mend if asked, recognise, state."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from hexapod_pin.errors import HexapodError, UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.loading.load_options import LoadOptions, read_hints
from hexapod_pin.robot.mending.find_all import check_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.robot_text import read_robot_text
from hexapod_pin.robot.recognition.layout import RobotLayout, stated
from hexapod_pin.robot.recognition.recognise import recognise

if TYPE_CHECKING:
    from hexapod_pin.robot.mending.finding import MendOptions


@dataclass(frozen=True)
class Intake:
    """A robot's file as it is used.

    Attributes:
        file: the URDF that says everything.
        layout: what was found in it.
        options: how it was read, hints included.
        mended: what was changed to mend it.
        notes: what was assumed in reading it, and what is suspicious in it.
    """

    file: UrdfFile
    layout: RobotLayout
    options: LoadOptions
    mended: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def feet(self) -> tuple[str, ...] | None:
        """Foot links as given; None where the file states its legs."""
        return None if self.layout.inferred else self.options.feet


def read_explicit(path: Path, arguments: LoadOptions) -> Intake:
    """Read a robot's file and state in it what its geometry and its hints say.

    Raises:
        UrdfError: the file cannot be used; all findings at once.
        ParameterError: a hint out of range.
        UnknownNameError: a hint names no link or joint.
    """
    options = arguments.over(read_hints(path))
    return explicit(read_file(path, options), options)


def explicit(read: SourceFile, options: LoadOptions) -> Intake:
    """State in a robot's file, as read, what its geometry and its hints say; as `read_explicit`."""
    file, finder, _, notes = read
    mended: tuple[str, ...] = ()
    if options.mend:
        from hexapod_pin.robot.mending.mend_urdf import mend_urdf

        done = mend_urdf(file, finder, _mend_options(options))
        file, mended = done.file, done.changes
        notes = (*notes, *done.notes)
    findings, suspicious = check_urdf(file)
    if findings:
        endless = all("continuous joint" in text for text in findings)
        more = _unrecognised(file, finder, options) if endless else []
        raise UrdfError(file.source, [*findings, *more])
    layout = recognise(file, finder, options)
    return Intake(stated(file, layout), layout, options, mended, (*notes, *suspicious))


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


def _mend_options(options: LoadOptions) -> MendOptions:
    from hexapod_pin.robot.mending.finding import MendOptions

    return MendOptions(
        mass=options.mass, density=options.density,
        effort=options.effort, velocity=options.velocity,
    )  # fmt: skip

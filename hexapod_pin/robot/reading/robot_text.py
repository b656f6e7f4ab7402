"""The URDF text of a robot's file: the file itself, or what its xacro expands to."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.other_formats import advice_on
from hexapod_pin.robot.description.urdf_file import (
    MAX_BYTES,
    checked_text,
    parse_tree,
    read_bytes,
)
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.xacro_file import expand_xacro

_OLD_TAGS = ("include", "macro", "property")


@dataclass(frozen=True)
class RobotText:
    """A URDF.

    Attributes:
        text: of the URDF.
        notes: a line on each thing assumed on the way; none where the file is a URDF.
        expanded: whether xacro made the text.
    """

    text: str
    notes: tuple[str, ...] = ()
    expanded: bool = False


def read_robot_text(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_path: Sequence[str | Path] = (),
    max_bytes: int = MAX_BYTES,
) -> RobotText:
    """Read a URDF as it is, or expand a xacro file.

    A file is xacro if its name ends with .xacro or elements of it begin with xacro:.

    Args:
        path: URDF or xacro file.
        xacro_args: values of <xacro:arg>; refused for a URDF, which has none.
        package_path: folders that hold the packages that xacro includes.
        max_bytes: of any file read, and of the expanded text.

    Raises:
        UrdfError: as `read_urdf`; an include, a package or an argument is missing (by name); an
            argument is not asked for; the file is of another kind (which, and what to do).
    """
    source, arguments = str(path), dict(xacro_args or {})
    text = checked_text(read_bytes(path, max_bytes=max_bytes), source, max_bytes)
    if not is_xacro(source, text):
        if arguments:
            names = ", ".join(arguments)
            raise UrdfError(source, [f"a URDF, not xacro: takes no xacro argument ({names})"])
        return RobotText(text)
    _refuse_other_formats(source, text)
    if "<xacro:" in text and "xmlns:xacro" not in text:
        way = 'declare it in <robot> by xmlns:xacro="http://www.ros.org/wiki/xacro"'
        raise UrdfError(source, [f"unbound prefix xacro: {way}"])
    finder = ResourceFinder(path, package_path)
    expanded, notes = expand_xacro(Path(path), finder, arguments, max_bytes=max_bytes)
    _check_expanded(source, text, expanded)
    return RobotText(expanded, tuple(notes), expanded=True)


def is_xacro(source: str, text: str) -> bool:
    """Tell whether a file must be expanded: by its name, or by elements that begin with xacro:.

    Such elements without a declared prefix are left-overs, not xacro.
    """
    if source.casefold().endswith(".xacro"):
        return True
    if "<xacro:" not in text or "xmlns:xacro" not in text:
        return False
    return any(element.tag.startswith("xacro:") for element in parse_tree(text, source).iter())


def _refuse_other_formats(source: str, text: str) -> None:
    root = parse_tree(text, source)
    if root.tag != "robot":
        finding = f"the outermost element is <{root.tag}>: must be <robot>"
        raise UrdfError(source, [finding + advice_on(root)])


def _check_expanded(source: str, text: str, expanded: str) -> None:
    """Refuse what expands to no robot: macros that nothing calls, or xacro of before ROS Jade."""
    root = ET.fromstring(checked_text(expanded.encode("utf-8", "replace"), source))
    if old := sorted({element.tag for element in root if element.tag in _OLD_TAGS}):
        tags = ", ".join(f"<{tag}>" for tag in old)
        raise UrdfError(
            source, [f"{tags} without the prefix xacro: (as before ROS Jade): write it in front"]
        )
    if root.find("link") is None:
        macros = [e.get("name", "") for e in ET.fromstring(text).iter() if _is_macro(e.tag)]
        called = f" ({', '.join(macros[:5])})" if macros else ""
        raise UrdfError(
            source,
            [f"expands to a robot without links: its macros{called} are called by another file; "
             "give that one"],
        )  # fmt: skip


def _is_macro(tag: object) -> bool:
    return isinstance(tag, str) and tag.startswith("{") and tag.endswith("}macro")

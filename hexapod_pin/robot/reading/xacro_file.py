"""Expanding a xacro file into a URDF, by the library of ROS's own xacro.

xacro computes: a file may hold Python expressions. The library evaluates ${...} without builtins
but leaves ways around that, and $(eval ...) with all of them. Here both are evaluated
without builtins, and names that lead out of an expression (`__class__`, frames) are refused.
A file can still read environment variables and YAML files, and can take very long: this is a fence,
not a prison, and a file from a stranger deserves a look.

$(find package) stays package://package in the text, so that the text is the same on every machine;
files are opened where `ResourceFinder` finds them.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from threading import RLock

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.xacro_library import FoundIncludes, patched_xacro

MAX_NOTES = 20
"""Most notes on one expansion."""

_LOCK = RLock()


class XacroArguments(dict[str, str]):
    """Arguments by name; remembers those that the file asks for."""

    def __init__(self, given: Mapping[str, str]) -> None:
        """Begin with what the user gives; xacro adds the defaults."""
        super().__init__(given)
        self.given, self.asked = dict(given), set[str]()

    def __contains__(self, name: object) -> bool:
        """Tell whether an argument has a value; a file asks so before it sets a default."""
        self.asked.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        """Return the value of an argument."""
        self.asked.add(name)
        return super().__getitem__(name)

    def missing(self, names: Iterable[str]) -> list[str]:
        """Return which of these arguments the file asks for and nobody gives."""
        return [name for name in dict.fromkeys(names) if name in self.asked - self.given.keys()]

    def notes(self) -> list[str]:
        """Return a line on each argument that the file asks for."""
        return [
            f"xacro argument {name} = {value} ({'given' if name in self.given else 'default'})"
            for name, value in sorted(self.items())
        ]


def expand_xacro(
    path: Path, finder: ResourceFinder, arguments: Mapping[str, str], *, max_bytes: int
) -> tuple[str, list[str]]:
    """Return the URDF that a xacro file expands to, and notes on how; prints nothing.

    Args:
        path: the xacro file.
        finder: finds packages and included files.
        arguments: values of <xacro:arg>, before their defaults.
        max_bytes: of any file read, and of the expanded text.

    Raises:
        UrdfError: a package, an included file or an argument is missing (each by name, with the
            way out), an expression fails, or the text grows too large.
    """
    import xacro

    source, values = str(path), XacroArguments(arguments)
    includes = FoundIncludes(finder, max_bytes)
    said = io.StringIO()
    with _LOCK, patched_xacro(includes), redirect_stderr(said), redirect_stdout(said):
        try:
            xacro.init_stacks(str(finder.urdf_path))
            document = xacro.parse(None, str(finder.urdf_path))
            xacro.process_doc(document, mappings=values, verbosity=0)
            text: str = document.toxml()
        except Exception as error:  # expressions raise anything
            where = [str(file) for file in xacro.filestack or [] if file]
            missing = values.missing(includes.plain_arguments)
            findings = [*map(_no_value, missing), *_findings(error, where)]
            raise UrdfError(source, findings) from error
    if missing := values.missing(includes.plain_arguments):
        raise UrdfError(source, list(map(_no_value, missing)))
    _check_arguments(source, values)
    if len(text.encode("utf-8", "replace")) > max_bytes:
        raise UrdfError(source, [f"xacro: expands to more than {max_bytes} bytes"])
    warned = [line.strip() for line in said.getvalue().splitlines() if "warning: " in line]
    notes = [*values.notes(), *includes.notes, *(f"xacro: {line}" for line in warned)]
    return text, list(dict.fromkeys(notes))[:MAX_NOTES]


def _check_arguments(source: str, values: XacroArguments) -> None:
    """Refuse arguments that the file never asks for."""
    if unknown := sorted(set(values.given) - values.asked):
        known = ", ".join(sorted(values.asked)) or "none"
        raise UrdfError(source, [f"no xacro argument {unknown[0]!r}; the file asks for: {known}"])


def _findings(error: Exception, where: list[str]) -> list[str]:
    """Return what went wrong, where, and the way out."""
    from xacro.substitution_args import ArgException

    place = f" (in {where[-1]})" if where else ""
    for inner in _chain(error):
        if isinstance(inner, UrdfError):
            other = [] if inner.source in where[:1] else [f"{inner.source}: "]
            return ["".join((*other, finding)) for finding in inner.findings]
        if isinstance(inner, ArgException):
            return [_no_value(str(inner.args[0])) + place]
        if isinstance(inner, OSError):
            return [
                f"xacro: file {inner.filename} cannot be read ({inner.strerror}){place}: download "
                "it too, or give the folder of its package by package_path=[...]"
            ]
        if isinstance(inner, RecursionError):
            return [f"xacro: files or macros include each other without end{place}"]
    return [f"xacro: {' '.join(str(error).split()) or type(error).__name__}{place}"]


def _no_value(name: str) -> str:
    return f"xacro argument {name!r} has no value: give it by xacro_args=[...] ({name}=VALUE)"


def _chain(error: BaseException) -> list[BaseException]:
    """Return an exception and those that it wraps, the outermost first."""
    found: list[BaseException] = []
    inner: BaseException | None = error
    while inner is not None and inner not in found:
        found.append(inner)
        inner = getattr(inner, "exc", None) or inner.__cause__ or inner.__context__
    return found

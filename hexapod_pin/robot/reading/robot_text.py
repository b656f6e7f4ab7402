"""The URDF text of a robot's file: the file itself, what its xacro expands to, or a converted MJCF.

The xacro library runs with its file access and its expressions restricted.
"""

from __future__ import annotations

import io
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from threading import RLock
from typing import Any
from xml.dom import minidom

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import (
    MAX_BYTES,
    advice_on,
    checked_text,
    parse_tree,
    read_bytes,
)
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.xacro_expression import value_of
from hexapod_pin.user_file import read_bytes as read_included

_OLD_TAGS = ("include", "macro", "property")


@dataclass(frozen=True)
class RobotText:
    """A URDF.

    Attributes:
        text: of the URDF.
        notes: a line on each assumption; none where the file is a URDF.
        expanded: whether the text was made of another one, of xacro or MJCF.
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
    """Read a URDF as it is, expand a xacro file, or convert an MJCF file.

    A file is xacro if its name ends with .xacro or elements of it begin with xacro:, and MJCF if
    its outermost element is <mujoco>.

    Args:
        path: URDF, xacro or MJCF file.
        xacro_args: values of <xacro:arg>; refused for a URDF or MJCF, which have none.
        package_path: folders that hold the packages that xacro includes.
        max_bytes: of any file read, and of the expanded text.

    Raises:
        UrdfError: as `read_urdf`; an include, a package or an argument is missing (by name); an
            argument is not used; the file is of another kind (which, and what to do).
    """
    source, arguments = str(path), dict(xacro_args or {})
    text = checked_text(read_bytes(path, max_bytes=max_bytes), source, max_bytes)
    if not is_xacro(source, text):
        if arguments:
            names = ", ".join(arguments)
            raise UrdfError(source, [f"a URDF, not xacro: takes no xacro argument ({names})"])
        if is_mjcf(text):
            from hexapod_pin.robot.reading.mjcf_urdf import urdf_of_mjcf

            return RobotText(*urdf_of_mjcf(path), expanded=True)
        return RobotText(text)
    _refuse_other_formats(source, text)
    if "<xacro:" in text and "xmlns:xacro" not in text:
        remedy = 'declare it in <robot> by xmlns:xacro="http://www.ros.org/wiki/xacro"'
        raise UrdfError(source, [f"unbound prefix xacro: {remedy}"])
    finder = ResourceFinder(path, package_path)
    expanded, notes = expand_xacro(Path(path), finder, arguments, max_bytes=max_bytes)
    _check_expanded(source, text, expanded)
    return RobotText(expanded, tuple(notes), expanded=True)


def is_xacro(source: str, text: str) -> bool:
    """Return whether a file must be expanded: by its name, or by elements that begin with xacro:.

    Such elements without a declared prefix are left-overs, not xacro.
    """
    if source.casefold().endswith(".xacro"):
        return True
    if "<xacro:" not in text or "xmlns:xacro" not in text:
        return False
    return any(element.tag.startswith("xacro:") for element in parse_tree(text, source).iter())


def is_mjcf(text: str) -> bool:
    """Return whether a checked XML text is MJCF, MuJoCo's format."""
    return "<mujoco" in text and ET.fromstring(text).tag == "mujoco"


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


# Expanding a xacro file into a URDF, by the library of ROS's own xacro.
#
# xacro computes: a file may hold Python expressions. The library evaluates ${...} without builtins
# but can be circumvented, and $(eval ...) with all of them. Here both are evaluated without
# builtins, and names that lead out of an expression (`__class__`, frames) are refused. A file can
# still read environment variables and YAML files, and can take very long: this is a fence, not a
# prison, and a file from a stranger deserves a look.
#
# $(find package) stays package://package in the text, so that the text is the same on every
# machine; files are opened where `ResourceFinder` finds them.

MAX_NOTES = 20
"""Most notes on one expansion."""

_LOCK = RLock()


class XacroArguments(dict[str, str]):
    """Arguments by name; remembers those that the file uses."""

    def __init__(self, given: Mapping[str, str]) -> None:
        """Begin with what the user gives; xacro adds the defaults."""
        super().__init__(given)
        self.given, self.used = dict(given), set[str]()

    def __contains__(self, name: object) -> bool:
        """Return whether an argument has a value; a file tests it before it sets a default."""
        self.used.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        """Return the value of an argument."""
        self.used.add(name)
        return super().__getitem__(name)

    def missing(self, names: Iterable[str]) -> list[str]:
        """Return which of these arguments the file uses and the user does not give."""
        return [name for name in dict.fromkeys(names) if name in self.used - self.given.keys()]

    def notes(self) -> list[str]:
        """Return a line on each argument that the file uses."""
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
        UrdfError: a package, an included file or an argument is missing (each by name, with a
            remedy), an expression fails, or the text grows too large.
    """
    import xacro

    source, values = str(path), XacroArguments(arguments)
    includes = FoundIncludes(finder, max_bytes)
    printed = io.StringIO()
    with _LOCK, patched_xacro(includes), redirect_stderr(printed), redirect_stdout(printed):
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
    warned = [line.strip() for line in printed.getvalue().splitlines() if "warning: " in line]
    notes = [*values.notes(), *includes.notes, *(f"xacro: {line}" for line in warned)]
    return text, list(dict.fromkeys(notes))[:MAX_NOTES]


def _check_arguments(source: str, values: XacroArguments) -> None:
    """Refuse arguments that the file does not use."""
    if unknown := sorted(set(values.given) - values.used):
        known = ", ".join(sorted(values.used)) or "none"
        raise UrdfError(source, [f"no xacro argument {unknown[0]!r}; the file uses: {known}"])


def _findings(error: Exception, where: list[str]) -> list[str]:
    """Return what went wrong, where, and a remedy."""
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


# The xacro library with its files found by `ResourceFinder` and its expressions fenced in.

_PACKAGE = "package://"
MAX_MACRO_CALLS = 5000
"""Most calls of macros in an expansion."""
_PLAIN_FUNCTIONS = {
    function.__name__: function
    for function in (abs, bool, dict, float, int, len, list, map, max, min, round, str, sum)
}


class FoundIncludes:
    """The files that a xacro file includes, as a finder finds them.

    Attributes:
        notes: a line on each file that is not at the path of its name.
        plain_arguments: names of <xacro:arg> without a default, which the library refuses.
    """

    def __init__(self, finder: ResourceFinder, max_bytes: int) -> None:
        """Take the finder, and the size of the largest file that is read [bytes]."""
        self.finder, self.max_bytes = finder, max_bytes
        self.notes: list[str] = []
        self.plain_arguments: list[str] = []
        self._macro_calls = 0

    def count_macro_call(self) -> None:
        """Count a call of a macro.

        Raises:
            UrdfError: there are more than any robot needs.
        """
        self._macro_calls += 1
        if self._macro_calls > MAX_MACRO_CALLS:
            finding = f"more than {MAX_MACRO_CALLS} calls of macros: call them less often"
            raise UrdfError(str(self.finder.urdf_path), [finding])

    def path(self, name: str, beside: str | None) -> str:
        """Return the path of a file named in the file `beside`; it need not exist."""
        if not name.startswith(_PACKAGE):
            path = os.path.join(os.path.dirname(beside or str(self.finder.urdf_path)), name)
            if os.path.exists(path) or re.search(r"[*[?]", name):
                return path
            return self._elsewhere(name, beside) or path
        package, _, rest = name[len(_PACKAGE) :].partition("/")
        folder = self.finder.package(package)
        if folder is not None and (re.search(r"[*[?]", rest) or os.path.exists(folder / rest)):
            return str(folder / rest)
        if (found := self._elsewhere(name, beside)) is not None:
            return found
        if folder is not None:
            return str(folder / rest)
        raise UrdfError(
            str(self.finder.urdf_path),
            [
                f"xacro includes $(find {package})/{rest}, and package {package!r} is not found: "
                f"download it too and give its folder by package_path=[...]"
            ],
        )

    def regular(self, name: str, beside: str | None) -> str:
        """Return the path of a file as `path` does.

        Raises:
            UrdfError: it is a folder, a device or a pipe, or too large.
        """
        path = self.path(name, beside)
        if os.path.exists(path) and not os.path.isfile(path):
            raise UrdfError(path, ["no regular file"])
        if os.path.isfile(path) and os.path.getsize(path) > self.max_bytes:
            raise UrdfError(path, [f"larger than {self.max_bytes} bytes"])
        return path

    def _elsewhere(self, name: str, beside: str | None) -> str | None:
        """Return the file by the end of its path, unless that is the including file."""
        found = self.finder.find(name)
        if found is None or (beside is not None and found == Path(beside)):
            return None
        if note := self.finder.note(name):
            self.notes.append(f"xacro include {name}: taken from {found} ({note})")
        return str(found)

    def document(self, path: str) -> minidom.Document:
        """Parse a file; a document type declaration is refused, as in a URDF."""
        data = read_included(path, self.max_bytes)
        document = minidom.parseString(checked_text(data, path, self.max_bytes).encode())
        for element in document.getElementsByTagName("xacro:arg"):
            if not element.hasAttribute("default"):
                self.plain_arguments.append(element.getAttribute("name"))
                element.setAttribute("default", "")
        return document


@contextmanager
def patched_xacro(includes: FoundIncludes) -> Iterator[None]:
    """Let the library find files by `includes`, and find the values of expressions by walking them.

    The library has its state in its module: not for two threads at once.
    """
    import xacro
    from xacro import substitution_args as arguments

    def parse(inp: Any, filename: str | None = None) -> Any:
        if inp is not None or filename is None:
            return inp
        try:
            return includes.document(filename)
        except OSError as error:
            xacro.filestack.pop()
            raise xacro.XacroException(str(error), exc=error) from error

    call_macro = xacro.handle_macro_call

    def counted_macro(*call: Any) -> Any:
        includes.count_macro_call()
        return call_macro(*call)

    def beside() -> str | None:
        return xacro.filestack[-1] if xacro.filestack else None

    changes: list[tuple[Any, str, Any]] = [
        (xacro, "parse", parse),
        (xacro, "safe_eval", evaluate),
        (xacro, "handle_macro_call", counted_macro),
        (xacro, "abs_filename_spec", lambda name: includes.regular(str(name), beside())),
        (xacro, "filestack", None),
        (xacro, "macrostack", None),
        (xacro, "verbosity", 0),
        (xacro, "all_includes", []),
        (arguments, "_eval_find", _find),
        (arguments, "_eval", _evaluate_argument),
        (arguments, "_eval_dict", {**arguments._eval_dict, "find": _find}),
    ]
    before = [(module, name, getattr(module, name)) for module, name, _ in changes]
    try:
        for module, name, value in changes:
            setattr(module, name, value)
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)
        xacro.substitution_args_context.clear()


def evaluate(expression: str, names: Any, local: Any = None) -> Any:
    """Return the value of an expression with these names and nothing else.

    Raises:
        ValueError: a part of it is not allowed, or would grow without end.
    """
    return value_of(expression, local, names)


def _evaluate_argument(text: str, context: dict[str, Any]) -> str:
    """Evaluate what stands in $(eval ...): as the library does, but by walking it."""
    from xacro import substitution_args as arguments

    values: Mapping[str, str] = context.get("arg", {})

    def argument(name: str) -> Any:
        return arguments.convert_value(arguments._eval_arg(name, args=values), "auto")

    functions = {**arguments._eval_dict, **_PLAIN_FUNCTIONS, "arg": argument}
    return str(evaluate(text, {}, arguments._DictWrapper(values, functions)))


def _find(package: str) -> str:
    """Return what $(find package) stands for in the text."""
    return _PACKAGE + package

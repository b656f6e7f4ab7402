"""The xacro library with its files found by `ResourceFinder` and its expressions fenced in."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.dom import minidom

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import checked_text
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.xacro_expression import value_of
from hexapod_pin.user_file import read_bytes

_PACKAGE = "package://"
MAX_MACRO_CALLS = 5000
"""Most calls of macros in an expansion."""
_PLAIN_FUNCTIONS = {
    function.__name__: function
    for function in (abs, bool, dict, float, int, len, list, map, max, min, round, str, sum)
}


class FoundIncludes:
    """The files that a xacro file asks for, as a finder finds them.

    Attributes:
        notes: a line on each file that does not lie where its name says.
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
            told = f"more than {MAX_MACRO_CALLS} calls of macros: call them less often"
            raise UrdfError(str(self.finder.urdf_path), [told])

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
        """Return the file by the end of its path, unless that is the file that asks."""
        found = self.finder.find(name)
        if found is None or (beside is not None and found == Path(beside)):
            return None
        if note := self.finder.note(name):
            self.notes.append(f"xacro include {name}: taken from {found} ({note})")
        return str(found)

    def document(self, path: str) -> minidom.Document:
        """Parse a file; a document type declaration is refused, as in a URDF."""
        data = read_bytes(path, self.max_bytes)
        document = minidom.parseString(checked_text(data, path, self.max_bytes).encode())
        for element in document.getElementsByTagName("xacro:arg"):
            if not element.hasAttribute("default"):
                self.plain_arguments.append(element.getAttribute("name"))
                element.setAttribute("default", "")
        return document


@contextmanager
def patched_xacro(includes: FoundIncludes) -> Iterator[None]:
    """Let the library find files by `includes`, and find the values of expressions by walking them.

    The library keeps its state in its module: not for two threads at once.
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

"""What the names in a type annotation stand for, those imported for type checkers alone too."""

from __future__ import annotations

import ast
import builtins
import inspect
import sys
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import Any


def resolved(annotation: Any, function: Any) -> Any:
    """Return the type that an annotation names; `Any` where its module does not tell."""
    if not isinstance(annotation, str):
        return annotation
    module = inspect.unwrap(function).__module__
    try:
        return eval(annotation, {}, _Names(module))  # noqa: S307  # our own source
    except (NameError, TypeError, AttributeError, ImportError):
        return Any


class _Names(dict[str, Any]):
    """The names that an annotation of a module may use, those for type checkers included."""

    def __init__(self, module: str) -> None:
        super().__init__()
        self._module = module

    def __missing__(self, name: str) -> Any:
        module = sys.modules[self._module]
        if hasattr(module, name):
            return getattr(module, name)
        if hasattr(builtins, name):
            return getattr(builtins, name)
        source = _imports_for_checking(self._module).get(name)
        if source is None:  # such as another name for a type, for type checkers alone
            return Any
        return getattr(import_module(source[0]), source[1])


@cache
def _imports_for_checking(module: str) -> Mapping[str, tuple[str, str]]:
    """Return the names that a module imports where `TYPE_CHECKING`, with where they come from."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {
        alias.asname or alias.name: (statement.module or "", alias.name)
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }

"""The wheel holds no evidence: all modules in it are reached from the package or a command."""

from __future__ import annotations

import ast
import re
import sys
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]

ENTRIES = ("hexapod_pin", "hexapod_pin.__main__")

FOUND_BY_NAME = {
    "hexapod_pin.benchmark.engines.*_engine": "named in a table of engine.py, for `bench`",
    "hexapod_pin.validation.checks.*_checks": "found by registry.py in its folder, for `verify`",
}
"""Modules that a command imports by a name that it composes, with the place that does so."""

EVIDENCE = {"studies", "fuzz", "oracles", "random_scenes", "rewriting"}
"""Packages of scripts/ and tests/ that no module of the wheel may import."""


def packed() -> dict[str, Path]:
    """Return the modules that scikit-build packs, by their dotted names."""
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "scikit-build"
    ]
    found = {}
    for package in build["wheel"]["packages"]:
        for path in (ROOT / package).rglob("*.py"):
            place = path.relative_to(ROOT)
            if not any(fnmatch(str(place), pattern) for pattern in build["wheel"]["exclude"]):
                parts = place.with_suffix("").parts
                found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = packed()


@cache
def named(module: str) -> set[str]:
    """Return what a module imports, anywhere in it, and the modules that its texts name.

    A package with a stub imports what stands there, when it is first used.
    """
    found = set[str]()
    stub = MODULES[module].with_suffix(".pyi")
    if stub.exists():
        for node in ast.parse(stub.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom):
                place = ".".join(filter(None, (module, node.module)))
                found |= {place, *(f"{place}.{one.name}" for one in node.names)}
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {str(node.module), *(f"{node.module}.{one.name}" for one in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found |= {
                *re.findall(r"hexapod_pin(?:\.\w+)+", node.value),
                f"hexapod_pin.{node.value}",
            }
    return found


def test_every_module_of_the_wheel_is_reached() -> None:
    """Imports in functions, for type checkers and by name count; a part reaches its package."""
    waiting = {*ENTRIES, *(one for one in MODULES if one.startswith("hexapod_pin.commands."))}
    waiting |= {one for one in MODULES if any(fnmatch(one, place) for place in FOUND_BY_NAME)}
    reached = set[str]()
    while waiting:
        module = waiting.pop()
        reached.add(module)
        parents = {module.rpartition(".")[0]} - {""}
        waiting |= ((named(module) & MODULES.keys()) | parents) - reached
    assert sorted(MODULES.keys() - reached) == []


@pytest.mark.parametrize("place", FOUND_BY_NAME)
def test_modules_found_by_name_exist(place: str) -> None:
    assert [one for one in MODULES if fnmatch(one, place)]


def test_no_module_of_the_wheel_imports_evidence() -> None:
    for module in MODULES:
        assert not {name.partition(".")[0] for name in named(module)} & EVIDENCE, module

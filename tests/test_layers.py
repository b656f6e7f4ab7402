"""Layers hold for imports of every kind, also by a string; all modules of the wheel are reached."""

from __future__ import annotations

import re
import sys
from fnmatch import fnmatch
from pathlib import Path

import house_figures
import pytest
from house_figures import circles, read_package

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]

FOUND_BY_NAME = ("hexapod_pin.benchmark.engines.*_engine", "hexapod_pin.validation.checks.*_checks")
"""What `bench` and `verify` import so."""

EVIDENCE = "studies|fuzz|oracles|random_scenes|rewriting"
"""Packages of scripts/ and tests/ that no module of the wheel may import."""


@pytest.fixture(scope="module")
def modules() -> dict:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(house_figures, "_code_lines", lambda *_: ())  # nobody counts lines here
        return read_package(ROOT)


def levels_of(modules: dict) -> dict[str, int]:
    """Return the layer of each module that is in one of the rooms of pyproject.toml, 0 on top."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    [rooms] = [one["layers"] for one in contracts if one["type"] == "layers"]
    return {
        name: level
        for name in modules
        for level, layer in enumerate(rooms)
        if any(f"{name}.".startswith(f"{room}.") for room in layer.split(" | "))
    }


def test_imports_of_any_kind_make_no_circle_and_do_not_go_up(modules: dict) -> None:
    levels = levels_of(modules)
    assert len(set(levels.values())) > 5
    wrong = [
        f"{name} -> {target}"
        for name in levels
        for target in modules[name].all_imports & levels.keys()
        if levels[target] < levels[name]
    ]
    assert wrong == []
    graph = {name: set(module.all_imports) for name, module in modules.items()}
    assert circles(graph) == []


def test_a_string_that_names_a_module_is_seen(tmp_path: Path) -> None:
    """Also without the name of the package, and in a table."""
    low = 'from importlib import import_module\nfound = import_module("high.above")\n'
    low += 'KINDS = {"trace": "hexapod_pin.high.other"}\n'
    files = {"low/below": low, "high/above": "import hexapod_pin.low.below\n", "high/other": ""}
    for name, text in files.items():
        path = tmp_path / "hexapod_pin" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    graph = {name: set(module.all_imports) for name, module in read_package(tmp_path).items()}
    assert graph["hexapod_pin.low.below"] == {"hexapod_pin.high.above", "hexapod_pin.high.other"}
    assert circles(graph) == [["hexapod_pin.high.above", "hexapod_pin.low.below"]]


def test_every_module_of_the_wheel_is_reached_and_imports_no_evidence(modules: dict) -> None:
    """From the package or a command; a package imports what its stub names when that is used."""
    graph = {
        name: {*module.all_imports, name.rpartition(".")[0]} for name, module in modules.items()
    }
    for stub in (ROOT / "hexapod_pin").rglob("__init__.pyi"):
        package, text = ".".join(stub.parent.relative_to(ROOT).parts), stub.read_text("utf-8")
        for place, given in re.findall(r"^from \.([\w.]*) import ([^(\n]*)", text, re.MULTILINE):
            parts = [place] if place else re.findall(r"\w+", given)
            graph[package] |= {f"{package}.{part}" for part in parts}
    by_name = {place: [one for one in modules if fnmatch(one, place)] for place in FOUND_BY_NAME}
    assert all(by_name.values())
    commands = [one for one in modules if one.startswith("hexapod_pin.commands.")]
    waiting = {"hexapod_pin", "hexapod_pin.__main__", *commands, *sum(by_name.values(), [])}
    reached = {""}
    while waiting:
        module = waiting.pop()
        reached.add(module)
        waiting |= (graph[module] & {*modules, ""}) - reached
    assert sorted(modules.keys() - reached) == []
    for path in (ROOT / "hexapod_pin").rglob("*.py"):
        imports = rf"^\s*(from|import) ({EVIDENCE})\b"
        assert not re.search(imports, path.read_text("utf-8"), re.MULTILINE), path

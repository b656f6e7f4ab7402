"""The layers hold for imports of every kind: in functions, for type checkers and by a string."""

from __future__ import annotations

import ast
import sys
from functools import cache
from pathlib import Path

import house_figures
import pytest
from house_figures import circles, read_package

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]

IMPORTED_BY_NAME = {
    "hexapod_pin.study.runs.measure": "a measure of a user's own, in a worker process",
    "hexapod_pin.benchmark.engines.engine": "engines that need a package of their own",
    "hexapod_pin.validation.checks.registry": "the checks of `verify` are those of its folder",
}
"""Modules that import a module of the package by a name that they compose."""

PARSERS = {
    "json.load", "json.loads", "parsed_toml", "tomllib.loads", "Case.from_toml", "Scene.from_toml",
    "SweepStudy.from_toml",
}  # fmt: skip

READERS = {
    "hexapod_pin.benchmark.work_precision.scenes": "the scene's file that `bench` is given",
    "hexapod_pin.file_schema": "JSON texts in files",
    "hexapod_pin.results.run_record": "the case of a trace that was read from a file",
    "hexapod_pin.results.summary": "a summary's file",
    "hexapod_pin.results.trace_file": "a trace's file",
    "hexapod_pin.simulation.case": "a case's file",
    "hexapod_pin.spec": "TOML files of users",
    "hexapod_pin.study.runs.measure": "the rows of a store",
    "hexapod_pin.study.runs.outcome": "what a worker process returns",
    "hexapod_pin.study.runs.store_schema": "a store's tables",
    "hexapod_pin.study.runs.task": "the study that a worker process is given",
    "hexapod_pin.study.runs.worker_main": "the task that a worker process is given",
    "hexapod_pin.validation.case_result": "reference data",
    "hexapod_pin.validation.cases.drop": "reference data",
    "hexapod_pin.validation.cases.mirror": "that a checkpoint survives a file is what it tests",
    "hexapod_pin.validation.cases.robots": "reference data",
}
"""Modules that parse a text, and where it comes from: no process parses what it wrote itself."""


@pytest.fixture(scope="module")
def modules() -> dict:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(house_figures, "_code_lines", lambda *_: ())  # nobody counts lines here
        return read_package(ROOT)


def layers() -> list[set[str]]:
    """Return the rooms of pyproject.toml, the highest first."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    [found] = [one["layers"] for one in contracts if one["type"] == "layers"]
    return [set(layer.split(" | ")) for layer in found]


def level(module: str, rooms: list[set[str]]) -> int | None:
    """Return the layer that a module belongs to; None of those that are in none."""
    for k, layer in enumerate(rooms):
        if any(module == room or module.startswith(f"{room}.") for room in layer):
            return k
    return None


def test_imports_of_any_kind_make_no_circle_and_do_not_go_up(modules: dict) -> None:
    rooms = layers()
    levels = {name: level(name, rooms) for name in modules}
    wrong = [
        f"{name} -> {target}"
        for name, module in modules.items()
        for target in module.all_imports
        if None not in (own := levels[name], other := levels[target]) and other < own
    ]
    assert wrong == []
    graph = {name: set(module.all_imports) for name, module in modules.items()}
    assert circles(graph) == []


def test_a_string_that_names_a_module_is_seen(tmp_path: Path) -> None:
    """Also without the name of the package, and in a table."""
    for name, text in {
        "__init__": 'NAMES = {"a": "low.below"}',
        "low/__init__": "",
        "low/below": 'from importlib import import_module\nfound = import_module("high.above")\n'
        'KINDS = {"trace": "hexapod_pin.high.other"}\n',
        "high/__init__": "",
        "high/above": "import hexapod_pin.low.below\n",
        "high/other": "",
    }.items():
        path = tmp_path / "hexapod_pin" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    found = read_package(tmp_path)
    expected = {"hexapod_pin.high.above", "hexapod_pin.high.other"}
    assert found["hexapod_pin.low.below"].all_imports == expected
    graph = {name: set(module.all_imports) for name, module in found.items()}
    assert circles(graph) == [["hexapod_pin.high.above", "hexapod_pin.low.below"]]


@cache
def nodes(module: str) -> list[ast.AST]:
    """Return the syntax tree of a module, node by node."""
    path = ROOT.joinpath(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def dotted(node: ast.expr) -> str:
    """Return a name with dots as written; what stands before its last dot may be any expression."""
    if isinstance(node, ast.Name):
        return node.id
    return f"{dotted(node.value)}.{node.attr}" if isinstance(node, ast.Attribute) else ""


@cache
def calls(module: str) -> set[str]:
    """Return the names that a module calls, as written."""
    return {dotted(node.func) for node in nodes(module) if isinstance(node, ast.Call)}


def test_modules_of_the_package_are_imported_by_name_in_few_places(modules: dict) -> None:
    """Packages that a user may not have are imported by their names in the engines of `bench`."""
    engines = "hexapod_pin.benchmark.engines."
    found = {
        name for name in modules
        if calls(name) & {"import_module", "importlib.import_module", "__import__"}
        and not (name.startswith(engines) and name.endswith("_engine"))
    }  # fmt: skip
    assert found == set(IMPORTED_BY_NAME)
    assert {name for name in modules if calls(name) & PARSERS} == set(READERS)


RUNS_CASES = {
    "sqlite3": "hexapod_pin.study.runs.",
    "BatchRuns": "hexapod_pin.simulation.batch hexapod_pin.study.runs.",
    "ProcessPoolExecutor": "hexapod_pin.study.runs.",
    "ThreadPoolExecutor": "hexapod_pin.study.runs. hexapod_pin.simulation.accuracy_control "
    "hexapod_pin.rl.episode",
}
"""What only the runner of studies may use, by the modules (or packages, with a dot) that may."""


def names(module: str) -> set[str]:
    """Return the names that a module imports or reads."""
    kinds = {ast.Name: "id", ast.alias: "name"}
    return {getattr(node, kinds[type(node)]) for node in nodes(module) if type(node) in kinds}


def test_many_cases_are_run_in_one_way(modules: dict) -> None:
    """A study is a function of the runner: it opens no pool and no store of its own."""
    used = {module: names(module) & RUNS_CASES.keys() for module in modules}
    for name, allowed in RUNS_CASES.items():
        users = [module for module, found in used.items() if name in found]
        assert users and all(user.startswith(tuple(allowed.split())) for user in users), name


def test_data_without_a_type_crosses_few_borders(modules: dict) -> None:
    """Public fields of classes that are tables of names and anything: the count may only fall."""
    found = []
    for module in modules:
        for kind in nodes(module):
            if isinstance(kind, ast.ClassDef) and not kind.name.startswith("_"):
                found += [
                    f"{module}: {kind.name}.{field.target.id}"
                    for field in kind.body
                    if isinstance(field, ast.AnnAssign)
                    and isinstance(field.target, ast.Name)
                    and "[str, Any]" in ast.unparse(field.annotation)
                ]
    assert len(found) <= 36, "\n".join(found)

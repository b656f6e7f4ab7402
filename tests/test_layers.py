"""Rules of the design that no linter checks: layers, parsers, one runner, all modules reached."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
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

RUNS_CASES = {
    "sqlite3": "hexapod_pin.study.runs.",
    "BatchRuns": "hexapod_pin.simulation.batch hexapod_pin.study.runs.",
    "ProcessPoolExecutor": "hexapod_pin.study.runs.",
    "ThreadPoolExecutor": "hexapod_pin.study.runs. hexapod_pin.simulation.accuracy_control "
    "hexapod_pin.rl.episode",
}
"""What only the runner of studies may use, by the modules (or packages, with a dot) that may."""

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


@pytest.fixture(scope="module")
def trees(modules: dict) -> dict[str, list[ast.AST]]:
    """The syntax trees of all modules, node by node."""

    def file(module: str) -> Path:
        path = ROOT.joinpath(*module.split("."))
        return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")

    return {one: list(ast.walk(ast.parse(file(one).read_text("utf-8")))) for one in modules}


def test_few_modules_import_by_name_or_parse_a_text(trees: dict) -> None:
    """Packages that a user may not have are imported by their names in the engines of `bench`."""

    def callers(names: set[str]) -> set[str]:
        last = {name.rpartition(".")[2] for name in names}
        return {
            module
            for module, nodes in trees.items()
            for node in nodes
            if isinstance(node, ast.Call)
            and (getattr(node.func, "attr", "") or getattr(node.func, "id", "")) in last
            and ast.unparse(node.func) in names
        }

    by_name = callers({"import_module", "importlib.import_module", "__import__"})
    assert {one for one in by_name if not fnmatch(one, FOUND_BY_NAME[0])} == set(IMPORTED_BY_NAME)
    assert callers(PARSERS) == set(READERS)


def test_many_cases_are_run_in_one_way(trees: dict) -> None:
    """A study is a function of the runner: it opens no pool and no store of its own."""

    def named(nodes: list[ast.AST]) -> Iterator[str]:
        for node in nodes:
            if isinstance(node, ast.Name | ast.alias):
                yield node.id if isinstance(node, ast.Name) else node.name

    used = {module: set(named(nodes)) for module, nodes in trees.items()}
    for name, allowed in RUNS_CASES.items():
        users = [module for module, found in used.items() if name in found]
        assert users and all(user.startswith(tuple(allowed.split())) for user in users), name


def test_data_without_a_type_crosses_few_borders(trees: dict) -> None:
    """Public fields of classes that are tables of names and anything: the count may only fall."""
    found = [
        f"{module}: {kind.name}.{ast.unparse(field.target)}"
        for module, nodes in trees.items()
        for kind in nodes
        if isinstance(kind, ast.ClassDef) and not kind.name.startswith("_")
        for field in kind.body
        if isinstance(field, ast.AnnAssign) and "[str, Any]" in ast.unparse(field.annotation)
    ]
    assert len(found) <= 36, "\n".join(found)

"""The public names of the package, and what importing it costs."""

from __future__ import annotations

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from public_surface import MODULES, SURFACE, surface

import hexapod_pin as hp

VIEWERS = {"meshcat", "yourdfpy", "matplotlib", "xarray"}
HEAVY = {*VIEWERS, *"pinocchio scipy h5py pydantic trimesh collada xacro PIL".split()}


def test_exactly_the_promised_names_are_listed():
    """`__all__` holds each promised name once, and nothing else."""
    promised = ["__version__", *MODULES, *SURFACE[""].split()]
    assert sorted(hp.__all__) == sorted(promised)
    assert set(promised) <= set(dir(hp))
    assert all(getattr(hp, name) for name in MODULES) and len(surface()) > 100


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("HuntCrossley", "; it is hp.contact.HuntCrossley"),
        ("UrdfError", "; it is hp.errors.UrdfError"),
        ("Contcat", "; did you mean hp.Contact?"), ("Any", ""),
    ],
)  # fmt: skip
def test_a_name_that_is_elsewhere_or_misspelt_says_where_it_is(name: str, text: str):
    with pytest.raises(AttributeError) as caught:
        getattr(hp, name)
    assert str(caught.value) == f"hexapod_pin has no {name!r}{text}"
    assert caught.value.name == name


def test_version_is_that_of_the_installed_package():
    from importlib.metadata import version

    assert hp.__version__ == version("hexapod-pin")


def _loaded_after(*statements: str) -> list[set[str]]:
    """Return the modules that are loaded after each of some statements, one after another."""
    code = "import sys\n" + "".join(f"{one}\nprint(*sys.modules)\n" for one in statements)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return [set(line.split()) for line in done.stdout.splitlines()]


def test_libraries_are_loaded_where_they_are_used():
    """`--help` and tab completion stay quick; a torque run never pays for the viewer.

    SciPy's linear algebra takes a second to load; only the check of gains needs it. Hard cases and
    benchmarks load only with their commands.
    """
    package, controllers, runs, names = _loaded_after(
        "import hexapod_pin as hp",
        "hp.FootControl, hp.foot_control.SlipPid",
        "hp.simulate, hp.torque_budget, hp.load_robot",
        "[getattr(hp, name) for name in hp.__all__]",
    )
    (command,) = _loaded_after("import hexapod_pin.commands.app")
    assert not package & HEAVY and not command & HEAVY
    assert "scipy" not in controllers and not runs & VIEWERS
    evidence = ("hexapod_pin.validation", "hexapod_pin.benchmark")
    assert not [name for name in names if name.startswith(evidence)]


LAZY = (
    "robot drive control control.foot_control simulation results study study.runs interchange"
).split()


def test_a_room_loads_a_module_when_a_name_of_it_is_used():
    """A function is what its room lists also where the module of that name is loaded first."""
    rooms = [f"hexapod_pin.{room}" for room in LAZY]
    alone, named = _loaded_after(
        f"import {', '.join(rooms)}",
        "from hexapod_pin.results import stability\nassert callable(stability)",
    )
    own = {name for name in alone if name.startswith("hexapod_pin.")}
    assert own == {*rooms, "hexapod_pin.shown"}
    assert "hexapod_pin.results.stability" in named
    for name in ("control.leg_group", "results.torque_budget", "study.compare"):
        room, _, function = name.rpartition(".")
        importlib.import_module(f"hexapod_pin.{name}")
        assert inspect.isfunction(getattr(importlib.import_module(f"hexapod_pin.{room}"), function))


def test_a_walk_loads_nothing_that_it_does_not_use(tmp_path: Path):
    """Also of this package, and on no terminal no progress bar: half of its time was loading."""
    (loaded,) = _loaded_after(
        f"""from hexapod_pin.commands.app import main
sys.stdout, stdout = open({str(tmp_path / "text")!r}, "w"), sys.stdout
try:
    main(["walk", "kharagpur", "--no-html", "--out", {str(tmp_path / "a.nc")!r}])
except SystemExit as end:
    assert end.code == 0
sys.stdout = stdout"""
    )
    rooms = "control.foot_control study.sweep study.selection study.runs.store view"
    others = tuple(f"hexapod_pin.{room}" for room in rooms.split())
    assert not [name for name in loaded if name.startswith(others)]
    assert not loaded & {*VIEWERS, "rich", "sqlite3", "ssl"}


def test_a_name_that_a_stub_takes_from_another_package_stands_in_its_stub_too():
    """Else it is found only where another import has loaded it before: `hp.sizing` was one."""
    root = Path(hp.__file__).parent
    for stub in root.rglob("__init__.pyi"):
        for node in ast.parse(stub.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.ImportFrom):
                continue
            other = stub.parent.joinpath(*(node.module or "").split("."), "__init__.pyi")
            if other == stub or not other.exists():
                continue
            given = ast.parse(other.read_text(encoding="utf-8")).body
            names = {
                one.name for part in given if isinstance(part, ast.ImportFrom) for one in part.names
            }
            assert {one.name for one in node.names} <= names, (stub, node.module)

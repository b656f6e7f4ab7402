"""Options of loading a robot: from arguments, from the hints file, from the command line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from refusals import refused

from hexapod_pin.commands.options import load_options
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.loading.load_options import LoadOptions, hints_path, read_hints


def test_options_are_data() -> None:
    """Arguments go before hints."""
    hints = LoadOptions(forward="y", foot_radius=0.01, package_path=("a",))
    both = LoadOptions(forward="-x", repair=True).over(hints)
    assert both == LoadOptions(forward="-x", foot_radius=0.01, package_path=("a",), repair=True)
    options = LoadOptions(legs={"lf": ("a", "b")}, posture={"a": 0.1}, xacro_args={"n": "1"})
    assert LoadOptions(**options.given()) == options
    assert LoadOptions().given() == {}


@pytest.mark.parametrize("name", ["robot.urdf", "robot.urdf.xacro", "robot.xacro"])
def test_hints_stand_beside_the_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "robot.hints.toml").write_text('forward = "y"\n[posture]\na = 0.5\n')
    assert hints_path(tmp_path / name) == tmp_path / "robot.hints.toml"
    assert read_hints(tmp_path / name) == LoadOptions(forward="y", posture={"a": 0.5})
    assert read_hints(tmp_path / "other.urdf") == LoadOptions()


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("forwards = 1", "LoadOptions.forwards", 1), ("mass = -1.0", "LoadOptions.mass", -1.0),
        ("forward = ", "TOML text", "forward = "), ("mass = nan", "LoadOptions.mass", math.nan),
    ],
)  # fmt: skip
def test_a_bad_hints_file_is_named(tmp_path: Path, text: str, name: str, value: object) -> None:
    hints = tmp_path / "robot.hints.toml"
    hints.write_text(text)
    with refused(ParameterError, name, value, about=(str(hints),)):
        read_hints(tmp_path / "robot.urdf")


def test_the_command_line_speaks_degrees() -> None:
    options = load_options(
        feet="a, b", legs="lf=a,b;rf=c", posture="a=90,b=-45", held="head=30",
        package_path=[Path("/x")], xacro_arg=["n=1=2"], forward="y", repair=True, mass=2.0,
    )  # fmt: skip
    assert options.feet == ("a", "b") and options.legs == {"lf": ("a", "b"), "rf": ("c",)}
    assert options.posture == {"a": math.pi / 2, "b": -math.pi / 4}
    assert options.held == {"head": math.pi / 6} and options.xacro_args == {"n": "1=2"}
    assert options.package_path == ("/x",) and options.mass == 2.0


@pytest.mark.parametrize(
    ("given", "name", "value"),
    [({"posture": "a"}, "--posture", "a"), ({"posture": "a=x"}, "--posture", "a=x"),
     ({"held": "=3"}, "--held", "=3"), ({"legs": "lf"}, "--legs", "lf"),
     ({"xacro_arg": ["n"]}, "--xacro-arg", "n"), ({"mass": 3.0}, "--mass", 3.0)],
)  # fmt: skip
def test_a_text_of_another_form_names_its_option(given: dict, name: str, value: object) -> None:
    with refused(ParameterError, name, value):
        load_options(**given)

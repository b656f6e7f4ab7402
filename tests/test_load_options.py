"""Options of loading a robot: from arguments, from the hints file, from the command line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from hexapod_pin.commands.robot_options import load_options
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.loading.load_options import LoadOptions, hints_path, read_hints


def test_arguments_go_before_hints() -> None:
    hints = LoadOptions(forward="y", foot_radius=0.01, package_path=("a",))
    both = LoadOptions(forward="-x", mend=True).over(hints)
    assert both == LoadOptions(forward="-x", foot_radius=0.01, package_path=("a",), mend=True)


def test_what_is_given_reads_back_as_itself() -> None:
    options = LoadOptions(legs={"lf": ("a", "b")}, posture={"a": 0.1}, xacro_args={"n": "1"})
    assert LoadOptions(**options.given()) == options
    assert LoadOptions().given() == {}


@pytest.mark.parametrize("name", ["robot.urdf", "robot.urdf.xacro", "robot.xacro"])
def test_hints_stand_beside_the_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "robot.hints.toml").write_text('forward = "y"\n[posture]\na = 0.5\n')
    assert hints_path(tmp_path / name) == tmp_path / "robot.hints.toml"
    assert read_hints(tmp_path / name) == LoadOptions(forward="y", posture={"a": 0.5})
    assert read_hints(tmp_path / "other.urdf") == LoadOptions()


@pytest.mark.parametrize("text", ["forwards = 1", "mass = -1.0", "forward = ", "mass = nan"])
def test_a_bad_hints_file_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "robot.hints.toml").write_text(text)
    with pytest.raises(ParameterError, match=r"robot\.hints\.toml"):
        read_hints(tmp_path / "robot.urdf")


def test_the_command_line_speaks_degrees() -> None:
    options = load_options(
        feet="a, b", legs="lf=a,b;rf=c", posture="a=90,b=-45", hold="head=30",
        package_path=[Path("/x")], xacro_arg=["n=1=2"], forward="y", mend=True, mass=2.0,
    )  # fmt: skip
    assert options.feet == ("a", "b") and options.legs == {"lf": ("a", "b"), "rf": ("c",)}
    assert options.posture == {"a": math.pi / 2, "b": -math.pi / 4}
    assert options.held == {"head": math.pi / 6} and options.xacro_args == {"n": "1=2"}
    assert options.package_path == ("/x",) and options.mass == 2.0


@pytest.mark.parametrize(
    ("given", "named"),
    [({"posture": "a"}, "--posture"), ({"posture": "a=x"}, "--posture"),
     ({"hold": "=3"}, "--hold"), ({"legs": "lf"}, "--legs"), ({"xacro_arg": ["n"]}, "--xacro-arg"),
     ({"mass": 3.0}, "--mass")],
)  # fmt: skip
def test_a_text_of_another_form_names_its_option(given: dict, named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        load_options(**given)

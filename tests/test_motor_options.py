"""Options on the command line: names of motors, how a robot is loaded, its hints file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from broken_urdfs import broken, every
from conftest import Run
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.loading_options import load_options
from hexapod_pin.commands.options import chosen_motor, speed_limit, torque_limit
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.loading.load_options import LoadOptions, hints_path, read_hints

WALK = ("walk", "kharagpur", "--duration", "0.1", "--accuracy", "1e-2", "--no-html")
WALK_CASE = (*WALK, "--full", "--save-case", "case.toml", "--motor")


def test_walk_with_a_motor(run: Run, tmp_path: Path) -> None:
    """13 V on the row of 12 V are 13/12 of stall torque and no-load speed."""
    done = run(*WALK_CASE, "XM430-W350", "--voltage", "13")
    assert "assumed: rotor inertia" in done.out
    assert "stall torque 4.442 N m, no-load speed 5.219 rad/s" in done.out
    motor = hp.load_case(tmp_path / "case.toml").scene.servo.motor
    assert motor.voltage_ratio == pytest.approx(13 / 12, rel=1e-12)
    assert (motor.stall_torque, motor.gear_ratio) == (4.1, 353.5)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (("--motor", "AX-12A", "--voltage", "5"), "from 9 to 12 V"),
        (("--motor", "AX-12A", "--catalog", "none.csv"), "none.csv"),
        (("--voltage", "12"), "without --motor"),
    ],
)  # fmt: skip
def test_refused(run: Run, options: tuple[str, ...], text: str) -> None:
    done = run(*WALK, *options)
    assert (done.status, done.left) == (2, [])
    assert text in done.err


def test_limits_of_a_repaired_file(run: Run, tmp_path: Path) -> None:
    """A motor's stall torque as effort and its no-load speed as velocity."""
    (tmp_path / "bad.urdf").write_text(
        broken(every("joint", "limit", velocity="0", effort="0")).text
    )
    motor = ("--effort", "AX-12A", "--velocity", "mx-64 at 12 V")
    assert run("repair", "bad.urdf", "-o", "good.urdf", *motor).status == 0
    robot = hp.load_robot(tmp_path / "good.urdf")
    assert robot.effort_limit == pytest.approx(1.5, rel=1e-12)
    assert robot.velocity_limit == pytest.approx(6.5973, rel=1e-12)


def test_numbers_and_names() -> None:
    """A number stays one; a name is looked up; the rest is refused with what there is."""
    assert torque_limit("2.5") == 2.5
    assert speed_limit(" 1e1 ") == 10.0
    assert torque_limit("MG996R") == 1.079
    assert speed_limit("MG996R") == 6.1575
    assert torque_limit(None) is speed_limit(None) is None
    with refused(ParameterError, "--effort", "strong"):
        torque_limit("strong")
    with refused(ParameterError, "--velocity", "HerkuleX DRS-0201"):
        speed_limit("HerkuleX DRS-0201")
    assert chosen_motor(None, None, None) == (None, None, (), ())
    several = chosen_motor("MX-64", None, None)
    assert several.record.name == "MX-64 at 12 V"
    assert "supply of 12 V (--voltage)" in several.assumed
    assert several.motor.mass == 0.135  # so its torque is not taken for kgf cm
    assert chosen_motor("MX-64 at 12 V", None, None).assumed == several.assumed[:-1]


# how a robot is loaded ------------------------------------------------------------------------


def test_options_are_data() -> None:
    """Arguments go before hints."""
    hints = LoadOptions(forward="y", foot_radius=0.01, package_path=("a",))
    both = LoadOptions(forward="-x", repair=True).over(hints)
    assert both == LoadOptions(forward="-x", foot_radius=0.01, package_path=("a",), repair=True)
    options = LoadOptions(legs={"lf": ("a", "b")}, posture={"a": 0.1}, xacro_args={"n": "1"})
    assert LoadOptions(**options.given()) == options
    assert LoadOptions().given() == {}


@pytest.mark.parametrize("name", ["robot.urdf", "robot.urdf.xacro"])
def test_hints_stand_beside_the_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "robot.hints.toml").write_text('forward = "y"\n[posture]\na = 0.5\n')
    assert hints_path(tmp_path / name) == tmp_path / "robot.hints.toml"
    assert read_hints(tmp_path / name) == LoadOptions(forward="y", posture={"a": 0.5})
    assert read_hints(tmp_path / "other.urdf") == LoadOptions()


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("forwards = 1", "LoadOptions.forwards", 1), ("forward = ", "TOML text", "forward = "),
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
    [({"posture": "a=x"}, "--posture", "a=x"), ({"held": "=3"}, "--held", "=3"),
     ({"legs": "lf"}, "--legs", "lf"), ({"mass": 3.0}, "--mass", 3.0)],
)  # fmt: skip
def test_a_text_of_another_form_names_its_option(given: dict, name: str, value: object) -> None:
    with refused(ParameterError, name, value):
        load_options(**given)

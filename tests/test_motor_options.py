"""Options on the command line: motors, how a robot is loaded, and their names in errors."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from conftest import Run
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.loading_options import load_options
from hexapod_pin.commands.options import chosen_motor, in_options, speed_limit, torque_limit
from hexapod_pin.errors import GaitError, HexapodError, ParameterError, UrdfError
from hexapod_pin.robot.loading.load_options import LoadOptions, read_hints

WALK = ("walk", "kharagpur", "--duration", "0.1", "--accuracy", "1e-2", "--no-html")


def test_walk_with_a_motor(run: Run, tmp_path: Path) -> None:
    done = run(
        *WALK, "--full", "--save-case", "case.toml", "--motor", "XM430-W350", "--voltage", "13"
    )
    assert "assumed: rotor inertia" in done.out
    assert "stall torque 4.442 N m, no-load speed 5.219 rad/s" in done.out
    motor = hp.load_case(tmp_path / "case.toml").scene.servo.motor
    assert motor.voltage_ratio == pytest.approx(13 / 12, rel=1e-12)
    assert (motor.stall_torque, motor.gear_ratio) == (4.1, 353.5)


def test_refused(run: Run) -> None:
    for options, text in (
        (("--motor", "AX-12A", "--voltage", "5"), "from 9 to 12 V"),
        (("--motor", "AX-12A", "--catalog", "none.csv"), "none.csv"),
        (("--voltage", "12"), "without --motor"),
    ):
        done = run(*WALK, *options)
        assert (done.status, done.left) == (2, []) and text in done.err


def test_numbers_and_names() -> None:
    assert (torque_limit("2.5"), torque_limit("MG996R"), torque_limit(None)) == (2.5, 1.079, None)
    assert (speed_limit(" 1e1 "), speed_limit("MG996R")) == (10.0, 6.1575)
    with refused(ParameterError, "--effort", "strong"):
        torque_limit("strong")
    with refused(ParameterError, "--velocity", "HerkuleX DRS-0201"):
        speed_limit("HerkuleX DRS-0201")
    assert chosen_motor(None, None, None) == (None, None, (), ())
    several = chosen_motor("MX-64", None, None)
    assert several.record.name == "MX-64 at 12 V"
    assert "supply of 12 V (--voltage)" in several.assumed
    assert chosen_motor("MX-64 at 12 V", None, None).assumed == several.assumed[:-1]


def test_hints_stand_beside_the_file(tmp_path: Path) -> None:
    hints = tmp_path / "robot.hints.toml"
    hints.write_text('forward = "y"\n[posture]\na = 0.5\n')
    for name in ("robot.urdf", "robot.urdf.xacro"):
        assert read_hints(tmp_path / name) == LoadOptions(forward="y", posture={"a": 0.5})
    assert read_hints(tmp_path / "other.urdf") == LoadOptions()
    hints.write_text("forwards = 1")
    with refused(ParameterError, "LoadOptions.forwards", 1, about=(str(hints),)):
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


def test_a_text_of_another_form_names_its_option() -> None:
    for name, text in (("posture", "a=x"), ("held", "=3"), ("legs", "lf"), ("mass", 3.0)):
        with refused(ParameterError, f"--{name}", text):
            load_options(**{name: text})


# names of options in errors --------------------------------------------------------------------

OPTIONS = {
    name: f"--{name.replace('_', '-')}" for name in (
        "feet", "foot_radius", "cycle_time", "turn_rate", "heading", "method", "record"
    )
}  # fmt: skip


def test_arguments_become_options_where_the_command_has_them() -> None:
    turns = GaitError("at 2 rad/s. turn_rate can be at most 0.1 rad/s.", "turn_rate", 0.1)
    for error, message in (
        (ParameterError("Gait.cycle_time", 0.0, "above 0"), "--cycle-time = 0.0: must be above 0."),
        (ParameterError("Payload.mass", -1.0, "at least 0"), "Payload.mass = -1.0:"),
        (HexapodError("try method='robust' or accuracy=1e-5"), "try --method robust or accuracy="),
        (HexapodError("again with record=['com', 'energy']."), "again with --record com,energy."),
        (turns, "at 2 rad/s. --turn-rate can be at most 5.73 degrees/s."),
    ):
        assert message in in_options(error, OPTIONS)
        assert in_options(error, {}) == str(error)


def test_a_command_and_python_name_the_same(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "box.urdf"
    path.write_text(
        '<robot name="box"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
        'izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    done = run("walk", "box.urdf", "--no-html")
    assert done.status == 2 and "--feet a,b,c" in done.err and "feet=" not in done.err
    with refused(UrdfError, source=str(path), about=("feet=[...]",)):
        hp.load_robot(path)
    for option, value, says in (
        ("--record", "forces", "--record = 'forces'"),
        ("--out", "walk.txt", "must end in .nc, .h5, .hdf5, .csv, .csv.gz"),
    ):
        done = run("walk", "kharagpur", "--no-html", option, value)
        assert done.status == 2 and says in done.err and done.left == ["box.urdf"]

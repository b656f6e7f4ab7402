"""Errors that a command meets name its options; the same errors from Python name arguments."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import Run
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.options import in_options
from hexapod_pin.errors import GaitError, HexapodError, ParameterError, UrdfError

WALK = {
    name: f"--{name.replace('_', '-')}" for name in (
        "feet", "foot_radius", "cycle_time", "turn_rate", "heading", "method", "record"
    )
}  # fmt: skip


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ParameterError("Gait.cycle_time", 0.0, "above 0"), "--cycle-time = 0.0: must be above 0."),
        (ParameterError("Payload.mass", -1.0, "at least 0"), "Payload.mass = -1.0:"),
        (UrdfError("a.urdf", ["give feet=[...], the links"]), "give --feet a,b,c, the links"),
        (HexapodError("try method='robust' or accuracy=1e-5"), "try --method robust or accuracy="),
        (HexapodError("again with record=['com', 'energy']."), "again with --record com,energy."),
        (
            GaitError("at 2 rad/s. turn_rate can be at most 0.1 rad/s.", "turn_rate", 0.1),
            "at 2 rad/s. --turn-rate can be at most 5.73 degrees/s.",
        ),
    ],
)
def test_arguments_become_options_where_the_command_has_them(
    error: HexapodError, message: str
) -> None:
    assert message in in_options(error, WALK)
    assert in_options(error, {}) == str(error)


def test_a_command_and_python_name_the_same(tmp_path: Path, run: Run) -> None:
    """From the command line `--feet`, from Python `feet=`."""
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

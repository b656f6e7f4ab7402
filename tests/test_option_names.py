"""Errors that a command meets name its options; the same errors from Python name arguments."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.commands.options import in_options
from hexapod_pin.errors import GaitError, HexapodError, ParameterError, UrdfError

WALK = {name: f"--{name.replace('_', '-')}" for name in (
    "feet", "foot_radius", "stroke", "cycle_time", "turn_rate", "heading",
    "kp", "method", "step", "sample",
    "record", "duration",
)}  # fmt: skip


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ParameterError("foot_radius", -1.0, "at least 0 m"), "--foot-radius = -1.0: must be"),
        (ParameterError("Gait.cycle_time", 0.0, "above 0"), "--cycle-time = 0.0: must be above 0."),
        (ParameterError("Servo.kp.constrained-float", -1.0, "at least 0"), "--kp = -1.0:"),
        (ParameterError("sample/step", 0.3, "a whole number"), "--sample/--step = 0.3:"),
        (ParameterError("Payload.mass", -1.0, "at least 0"), "Payload.mass = -1.0:"),
        (UrdfError("a.urdf", ["give feet=[...], the links"]), "give --feet a,b,c, the links"),
        (HexapodError("try method='robust' or accuracy=1e-5"), "try --method robust or accuracy="),
        (HexapodError("again with record=['com', 'energy']."), "again with --record com,energy."),
        (GaitError("stroke can be at most 0.1 m.", "stroke", 0.1), "--stroke can be at most 0.1 m"),
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


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    with pytest.raises(SystemExit) as caught:
        main([str(part) for part in arguments])
    assert caught.value.code == 2
    return capsys.readouterr().err


def test_no_legs_ask_for_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From the command line `--feet`, from Python `feet=`."""
    path = tmp_path / "box.urdf"
    path.write_text(
        '<robot name="box"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
        'izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    message = refusal(capsys, "walk", path, "--out", tmp_path / "w.nc", "--no-html")
    assert "--feet a,b,c" in message
    assert "feet=" not in message
    with refused(UrdfError, source=str(path), about=("feet=[...]",)):
        hp.load_robot(path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--foot-radius", "-1"), "--foot-radius = -1.0"),
        (("--record", "forces"), "--record = 'forces'"),
        (("--out", "walk.txt"), "must end in .nc, .h5, .hdf5, .csv, .csv.gz"),
    ],
)
def test_walk_refuses_in_terms_of_its_options(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in refusal(capsys, "walk", "kharagpur", "--no-html", *options)
    assert not list(tmp_path.iterdir())

"""Paths and files of code that a user gave: `~`, names that no file can have, code to import."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin import stop_signals
from hexapod_pin.commands.import_file import import_file
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import user_path

Run = Callable[..., SimpleNamespace]


def test_a_tilde_is_the_users_home_and_that_of_nobody_stays(monkeypatch: pytest.MonkeyPatch):
    """`Path.expanduser` ends in a RuntimeError for a user who is not known."""
    monkeypatch.setenv("HOME", "/home/of-a-user")
    assert user_path("~/walk.nc") == Path("/home/of-a-user/walk.nc")
    assert user_path("a/~") == Path("a/~")
    for name in ("~unknown/x", "~a\0b/x"):
        assert user_path(name) == Path(name)


READERS = (
    hp.load_robot, hp.load_trace, hp.load_case, hp.study.load_study, hp.load_summary,
    hp.load_catalog, hp.load_sweep, hp.study.open_sweep, hp.study.load_gait_energy,
    hp.study.load_torque_map, lambda name: hp.HeightField.from_csv(name, 0.1),
    lambda name: hp.HeightField.from_image(name, 0.1, 0.1),
)  # fmt: skip


def test_no_file_is_a_typed_error_of_every_reader(tmp_path, monkeypatch):
    """Python 3.11 raises an OSError for a name that is too long, also by `Path.exists`."""
    monkeypatch.chdir(tmp_path)
    for read in READERS:
        for name in ("é" * 300, "~unknown/x", "."):
            with pytest.raises(hp.errors.HexapodError):
                read(name)
    assert not list(tmp_path.iterdir())


def test_what_is_written_at_home_is_read_there(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    trace = hp.simulate(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=0.02)
    trace.save("~/walk.nc")
    assert (tmp_path / "walk.nc").is_file()
    assert (hp.load_trace("~/walk.nc").q == trace.q).all()
    hp.load_catalog().save("~/motors.csv")
    assert hp.load_catalog("~/motors.csv").models == hp.load_catalog().models


def test_no_file_ends_a_command_in_one_line(run: Run, tmp_path: Path) -> None:
    """`sweep .` had no name for its store; a scene that is no UTF-8 was a UnicodeDecodeError."""
    (tmp_path / "latin.toml").write_bytes("name = 'é'".encode("latin-1"))
    for line, message in (
        (("sweep", "."), "study file"),
        (("check", "~unknown/x.urdf"), "no such file"),
        (("bench", "latin.toml"), "latin.toml"),
    ):
        done = run(*line)
        assert done.status == 2 and message in done.err and done.err.count("\n") == 1, done.err
        assert done.left == ["latin.toml"]


def test_a_folder_is_no_store(tmp_path: Path) -> None:
    study = hp.load_sweep(Path(__file__).parents[1] / "examples/friction_and_payload.toml")
    with refused(hp.errors.SweepStoreError, path=str(tmp_path), kept=None) as caught:
        hp.run_sweep(study, tmp_path)
    # neither one that is there, nor one that is locked; and it was not tried to open it
    assert type(caught.value) is hp.errors.SweepStoreError and caught.value.__cause__ is None
    assert not list(tmp_path.parent.glob("*-lock"))


def _refused(path: Path) -> str:
    modules, places = dict(sys.modules), list(sys.path)
    with refused(ParameterError, "--import", str(path)) as caught:
        import_file("--import", path)
    assert (sys.modules, sys.path) == (modules, places)
    return caught.value.hint


ENDINGS = {
    "import sys; sys.exit(0)": "SystemExit: 0",
    "class Own(BaseException): pass\nraise Own('words')": "Own: words",
    "class Mute(Exception):\n    def __str__(self): return 1\nraise Mute": "Mute",
    "def (": "SyntaxError: ",
    "x" + "+1" * 100_000: "Error: ",
}


@pytest.mark.parametrize("code", list(ENDINGS), ids=list(map(str, range(len(ENDINGS)))))
def test_a_file_that_ends_the_process_is_refused(code: str, tmp_path: Path) -> None:
    """By the option's error, whatever it raises; nothing of it stays behind."""
    path = tmp_path / "own.py"
    path.write_text(code)
    assert ENDINGS[code] in _refused(path)


def test_a_file_that_exits_is_status_two(run, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("import sys; sys.exit(0)")
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    case.save(tmp_path / "case.toml")
    found = run("run", "case.toml", "--no-html", "--import", "own.py")
    assert (found.status, found.left) == (2, ["case.toml", "own.py"])
    assert "--import" in found.err and "own.py" in found.err


def test_ctrl_c_during_an_import_stays_an_interruption(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text("raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        import_file("--import", path)
    assert "own" not in sys.modules
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stop_signals._state, "phase", stop_signals.RUNNING)
        assert _refused(path) == "KeyboardInterrupt"
        path.write_text("from hexapod_pin.stop_signals import StopSignal; raise StopSignal(2)")
        with pytest.raises(stop_signals.StopSignal):
            import_file("--import", path)


@pytest.mark.parametrize("name", ["pipe.py", "large.py", "own.txt", "none.py"])
def test_files_that_cannot_be_code_are_refused(name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.py")
    with open(tmp_path / "large.py", "wb") as large:
        large.truncate(1 << 34)
    (tmp_path / "own.txt").write_text("")
    _refused(tmp_path / name)


@pytest.mark.usefixtures("own_modules")
def test_a_file_takes_the_name_of_no_other_module(tmp_path: Path) -> None:
    """Neither one that is loaded already, nor one that is loaded later; its neighbours are last."""
    (tmp_path / "others").mkdir()
    for path in ("others/json.py", "others/numpy.py", "stringprep.py"):
        (tmp_path / path).write_text("mine = True\n")
    (tmp_path / "neighbour.py").write_text("value = 1")
    (tmp_path / "own.py").write_text(
        "from __future__ import annotations\n"
        "from dataclasses import dataclass\n"
        "from neighbour import value\n"
        "import stringprep\n"
        "@dataclass\n"
        "class Own:\n"
        "    value: int = value\n"
        "def fail():\n    raise ValueError\n"
    )
    sys.modules.pop("stringprep", None)
    for path in ("others/json.py", "others/numpy.py", "own.py"):
        import_file("--import", tmp_path / path)
    own = sys.modules["own"]
    assert sys.modules["json"] is json and not hasattr(own.stringprep, "mine")
    assert own.Own().value == 1
    assert own.__file__ == str(tmp_path / "own.py") and sys.path[-1] == str(tmp_path)
    with pytest.raises(ValueError) as raised:
        own.fail()
    assert raised.traceback[-1].path == tmp_path / "own.py"
    assert "raise ValueError" in str(raised.traceback[-1].statement)

"""A file of a user's code that a command imports: what it may do, and what is left of it."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin import stop_signals
from hexapod_pin.commands.import_file import import_file
from hexapod_pin.errors import ParameterError


def _refused(path: Path) -> str:
    """Return the way out that the refusal of a file states."""
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

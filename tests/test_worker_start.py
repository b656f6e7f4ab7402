"""Worker processes of a sweep run nothing that lies in the current folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import hexapod_pin as hp
from hexapod_pin.study.runs import workers as worker_processes
from tests.sweep_studies import require_same_bits, small_study, write_study_file

PATIENCE = 120.0
"""Longest wait for a process [s]."""

NAMES = ("struct", "json", "random", "ctypes", "queue", "numpy", "sitecustomize", "usercustomize")
"""Modules that Python, a worker or what it imports asks for."""

MODULE = """
import os
with open({marker!r}, "a") as marker:
    marker.write(f"{{os.getpid()}} {{__name__}}\\n")
"""

ENTRY = "import sys; from hexapod_pin.commands.app import main; main(sys.argv[1:])"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study with modules beside it that say who has run them."""
    write_study_file(tmp_path, 1)
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(MODULE.format(marker=str(tmp_path / "marker")))
    return tmp_path


def _started(folder: Path, start: list[str], **environment: str) -> tuple[int, set[int]]:
    """Run a sweep in a folder; return its process and the processes that ran modules there."""
    words = ["sweep", "study.toml", "--processes", "1", "--chunk", "1"]
    process = subprocess.Popen(
        [sys.executable, *start, *words], cwd=folder, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, env={**os.environ, **environment},
    )  # fmt: skip
    shown, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, shown
    assert "3 of 3 cases done, all walk" in shown
    marker = folder / "marker"
    lines = marker.read_text().splitlines() if marker.exists() else []
    return process.pid, {int(line.split()[0]) for line in lines}


def _console_script() -> str:
    """Return the installed command, which Python starts without the current folder."""
    script = Path(sys.executable).with_name("hexapod-pin")
    if not script.exists():
        pytest.skip("the command is not installed")
    return str(script)


@pytest.mark.slow
def test_modules_beside_a_study_are_not_run(folder: Path) -> None:
    """And the cases are what they are without workers, to the bit."""
    _, ran = _started(folder, [_console_script()])
    assert not ran
    here = hp.run_sweep(small_study(1), folder / "here.db", threads=1)
    require_same_bits(hp.study.open_sweep(folder / "study.db").dataset, here.dataset)


REAL = "exec((__import__('pathlib').Path(__import__('os').__file__).parent / '{}.py').read_text())"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "environment"),
    [(["-m", "hexapod_pin"], {}), (["-c", ENTRY], {"PYTHONPATH": f"{os.pathsep}/none"})],
)
def test_modules_that_the_command_itself_runs_are_not_run_by_workers(
    folder: Path, start: list[str], environment: dict[str, str]
) -> None:
    """Python gives these two ways of starting the current folder; it is not handed on.

    Nor is an empty entry of the path: `PYTHONPATH=$PYTHONPATH:/somewhere` has one where the
    variable was not set.
    """
    for path in folder.glob("*.py"):
        if path.stem in ("struct", "random", "queue"):
            path.write_text(path.read_text() + REAL.format(path.stem))
        elif not path.stem.endswith("customize"):
            path.unlink()
    process, ran = _started(folder, start, **environment)
    assert ran == {process}


def test_a_folder_that_was_named_is_handed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setattr(sys, "path", ["", str(tmp_path), "/one", tmp_path / "no text", "/two"])
    assert worker_processes._import_folders() == ["/one", "/two"]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", str(tmp_path)]))
    assert worker_processes._import_folders() == [str(tmp_path), "/one", "/two"]


def test_the_folder_of_the_package_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkout that is used in place."""
    home = Path(worker_processes.__file__).parents[3]
    monkeypatch.chdir(home)
    monkeypatch.setattr(sys, "path", ["", str(home), "/one"])
    assert worker_processes._import_folders() == [str(home), "/one"]


def test_a_folder_that_was_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    monkeypatch.setattr(sys, "path", ["", "here", "/one"])
    assert worker_processes._import_folders() == ["/one"]
    monkeypatch.chdir(tmp_path)


def test_the_first_statement_takes_the_folder_away(tmp_path: Path) -> None:
    """Before anything is imported that is not built in; for every release of Python alike."""
    (tmp_path / "struct.py").write_text("raise SystemExit('run')")
    statement = worker_processes.START.split(";")[1]
    code = f"import sys; {statement}; import struct; print('' in sys.path, struct.calcsize('Q'))"
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, cwd=tmp_path, capture_output=True, text=True,
        timeout=PATIENCE, env={**os.environ, "PYTHONSAFEPATH": ""},
    )  # fmt: skip
    assert done.stdout.split() == ["False", "8"]

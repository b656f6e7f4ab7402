"""`hexapod-pin sweep`: what it prints and leaves, how it goes on, and how it refuses."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.runs import run_sweep
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.text_table import WIDTH
from hexapod_pin.view.study_figures import draw_sweep, write_sweep_figure
from tests.sweep_studies import BASE, FRICTIONS, PAYLOADS, durations, small_study, write_study_file


def _run(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main(["sweep", *map(str, words)])
    return int(end.value.code or 0)


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file with 6 cases, in the folder where the command runs."""
    monkeypatch.chdir(tmp_path)
    return write_study_file(tmp_path, 2)


def test_it_leaves_store_dataset_and_figure(study: Path, capsys: Any) -> None:
    assert _run(study, "--out", "a.nc", "--plot", "a.svg", "--threads", 2) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0] == "short walks: 6 of 6 cases done, all walk" and not err
    assert lines[1].split() == ["slip", "per", "coxa", "femur", "tibia"]
    assert lines[2].split() == ["payload", "speed", "cycle", "peak", "peak", "peak"]
    assert lines[3].split()[:4] == ["case", "[kg]", "mu", "[m/s]"] and len(lines) <= 15
    assert "6 cases run in " in out and "store: " in out
    found = hp.study.open_sweep("study.db")
    with xarray.open_dataset("a.nc", engine="h5netcdf") as opened:
        np.testing.assert_array_equal(opened["torque_peak"], found.dataset["torque_peak"])
    assert Path("a.svg").read_text().lstrip().startswith("<?xml")
    assert _run(study) == 2  # it exists
    assert "6 cases of it finished: continue it with --resume" in capsys.readouterr().err
    assert _run(study, "--resume", "--out", "a.csv") == 0
    out = capsys.readouterr().out
    assert "cases run in" not in out and "wrote a.csv" in out.replace(f"{Path.cwd()}/", "")


def test_the_table_has_ten_rows_and_csv_files_the_columns_that_are_named(
    study: Path, capsys: Any
) -> None:
    """The largest torques stand in it; a file had 572 columns."""
    assert _run(study, "--out", "a.csv", "--columns", "walks,kind_torque_peak") == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines() if "/" not in line) <= WIDTH
    head, *rows = Path("a.csv").read_text().splitlines()
    kinds = [f"kind_torque_peak.{kind} [N m]" for kind in ("coxa", "femur", "tibia")]
    assert head.split(",") == ["case", "payload [kg]", "mu", "walks", *kinds] and len(rows) == 6
    found = hp.study.open_sweep("study.db")
    peak = found.columns["kind_torque_peak"].values.max(axis=1)
    largest = sorted(np.argsort(-peak, kind="stable")[:2].tolist())
    assert [int(cells[0]) for cells in found.table(2).rows] == largest
    assert _run(study, "--resume", "--json") == 0
    assert json.loads(capsys.readouterr().out)["columns"]["payload"] == [0, 0, 0.5, 0.5, 1, 1]
    assert _run(study, "--resume", "--out", "b.csv", "--columns", "nonsense") == 2
    assert "nonsense" in capsys.readouterr().err and not Path("b.csv").exists()
    assert _run(study, "--resume", "--columns", "walks") == 2


def test_what_a_sweep_came_to_is_told_without_xarray(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With it comes dask.array: 1.5 of the 3.9 s of a finished study's `--resume`."""
    assert _run(study) == 0
    found = hp.study.open_sweep("study.db")
    expected = int(np.sum(found.dataset["walks"].values == 0.0))
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert hp.study.open_sweep("study.db").not_walking == expected
    assert _run(study, "--resume", "--plot", "a.svg", "--out", "a.nc") == 0


def test_failed_cases_are_counted_by_reason(study: Path, capsys: Any) -> None:
    study.write_text(BASE + durations(0.9, -1.0))
    assert _run(study, "--store", "b.db") == 0
    out = capsys.readouterr().out
    assert "1 of 2 cases done, 1 failed" in out.splitlines()[0]
    assert "\n1 x ParameterError\ncase 1: ParameterError: " in out
    assert _run(study, "--store", "b.db", "--retry-failed") == 0
    assert "1 cases run in" in capsys.readouterr().out


def test_ctrl_c_ends_with_130_and_says_what_is_kept(
    study: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hexapod_pin.study.runs import store

    add = store.SweepStore.add

    def interrupted(self: Any, outcomes: Any) -> Any:
        new = add(self, outcomes)
        if len(self.finished) == 2:
            signal.raise_signal(signal.SIGINT)
        return new

    monkeypatch.setattr(store.SweepStore, "add", interrupted)
    assert _run(study) == 130
    assert "interrupted: 2 of 6 cases are kept in" in capsys.readouterr().err
    monkeypatch.undo()
    monkeypatch.chdir(study.parent)
    assert _run(study, "--resume") == 0
    assert "4 cases run in" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.toml"], "none.toml"),
        (["study.toml", "--out", "a.txt"], "--out a.txt"),
        (["study.toml", "--plot", "a.txt"], "a.txt"),
        (["study.toml", "--out", "none/a.nc"], "there is no folder"),
        (["study.toml", "--store", "none/a.db"], "there is no folder"),
        (["study.toml", "--threads", "0"], "--threads = 0: must be a whole number"),
        (["study.toml", "--chunk", "0"], "--chunk = 0: must be a whole number"),
        (["study.toml", "--processes", "1", "--scheduler", "tcp://x"], "one of them"),
        (["study.toml", "--import", "none.py"], "none.py"),
        (["study.toml", "--out", "a.csv", "--columns", "walks,peak"], "no column named 'peak'"),
        (["study.toml", "--out", "a.csv", "--columns", "path"], "no column named 'path'"),
    ],
)
def test_refusals_are_one_message(study: Path, capsys: Any, words: list[str], said: str) -> None:
    assert _run(*words) == 2
    err = capsys.readouterr().err
    assert err.startswith("hexapod-pin: ") and said in err and err.count("\n") == 1
    assert sorted(path.name for path in study.parent.iterdir()) == ["study.toml"]


def test_page_and_help_state_the_defaults_of_the_code(capsys: Any) -> None:
    from hexapod_pin.commands import walk
    from hexapod_pin.study.sweep import base_case

    page = (Path(__file__).parents[1] / "docs" / "sweeps.md").read_text()
    row = next(line for line in page.splitlines() if line.startswith("| `duration` |"))
    assert f" {base_case.LEAST_DURATION:g} s, or four cycles" in row
    assert f"(`walk`: {walk.LEAST_DURATION:g} s)" in row
    said = "the name of the study's file with .db, in the current folder"
    assert said in page.replace("`", "")
    assert _run("--help") == 0
    help_text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert said in help_text


STIFF = '\n[[vary]]\ninput = "servo_stiffness"\nvalues = [1.0, 2.0]\n'
TWO = PAYLOADS + STIFF


@pytest.mark.parametrize(
    ("inputs", "panels", "words"),
    [
        (PAYLOADS, 3, ["coxa", "payload [kg]", "torque of the worst joint [N m]"]),
        (TWO, 3, ["tibia", "servo_stiffness"]),
        (FRICTIONS.format(samples=4, seed=1), 4, ["peak torque [N m]", "mu"]),
    ],
)
def test_the_figure_follows_what_varies(
    tmp_path: Path, inputs: str, panels: int, words: list[str]
) -> None:
    found = run_sweep(SweepStudy.from_toml(BASE + inputs), tmp_path / "a.db")
    figure = draw_sweep(found)
    drawn = [axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"]
    assert len(drawn) == panels
    text = " ".join(
        part for axes in drawn for part in (axes.get_title(), axes.get_xlabel(), axes.get_ylabel())
    )
    assert all(word in text for word in words)
    if inputs is PAYLOADS:
        peak = found.dataset["kind_torque_peak"].sel(kind="femur").values
        line = drawn[1].get_lines()[0]
        np.testing.assert_array_equal(line.get_xdata(), [0.0, 0.5, 1.0])
        np.testing.assert_allclose(line.get_ydata(), peak, rtol=1e-15)
        assert max(axes.get_ylim()[1] for axes in drawn) >= peak.max()


def test_a_sweep_without_numbers_is_not_drawn(tmp_path: Path) -> None:
    from hexapod_pin.study.runs.store import SweepStore

    with SweepStore(tmp_path / "a.db", small_study(1)):
        pass
    with refused(ParameterError, "found", "not run"):
        write_sweep_figure(hp.study.open_sweep(tmp_path / "a.db"), tmp_path / "a.png")

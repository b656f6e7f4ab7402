"""`--verdict` of `walk`, `run` and `budget`: what they print, and how they stop."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

import hexapod_pin as hp

Run = Callable[..., SimpleNamespace]
WALK = (*"walk kharagpur --gait tripod --cycle-time 0.4 --stroke 0.03 --no-html".split(),)
QUICK = ("--accuracy", "1e-2", "--sample", "0.02")
STEADY = ("--duration", "1.2")  # two cycles to start, a steady one


def test_walk_run_and_budget_give_the_verdict_of_the_library(run: Run) -> None:
    """One walk, three commands, the same table; JSON holds all its numbers beside the budget."""
    options = (*QUICK, *STEADY, "--verdict", "--save-case", "case.toml")
    walked = run(*WALK, *options)
    assert (walked.status, walked.err) == (0, "")
    expected = hp.study.judge_peaks(hp.load_trace("walk.nc"))
    assert walked.out.endswith(expected.table() + "\n")
    assert walked.out.index("wrote ") < walked.out.index("Peaks with a verdict")
    again = run("run", "case.toml", "--no-html", "--verdict", "--threads", "2")
    assert again.out.endswith(expected.table() + "\n")
    assert run("budget", "walk.nc", "--verdict").out.endswith(expected.table() + "\n")
    data = json.loads(run("budget", "walk.nc", "--verdict", "--json").out)
    assert data.pop("verdict") == expected.to_dict()
    assert data == hp.torque_budget(hp.load_trace("walk.nc")).to_dict()
    assert "--verdict" in data["caveat"]


def test_a_walk_too_short_for_a_table_has_no_verdict_either(run: Run) -> None:
    done = run(*WALK, *QUICK, "--duration", "0.2", "--verdict")
    assert done.status == 0
    assert done.err.startswith("no torque table: ")
    assert "verdict" not in done.out


def test_a_trace_of_ones_own_controller_needs_its_file(run: Run, tmp_path: Path) -> None:
    """As `run` does, `budget --verdict` imports what registers it."""
    (tmp_path / "own.py").write_text(
        "import numpy as np\nimport hexapod_pin as hp\n"
        "class Stand:\n"
        "    period = 0.01\n"
        "    def start(self, scene, batch):\n"
        "        return scene.robot.posture\n"
        "    def update(self, time, m, posture):\n"
        "        return hp.feedback.Command(np.tile(posture, (len(m.q), 1))), posture\n"
        "    def to_dict(self):\n"
        "        return {'kind': 'stand-for-a-verdict'}\n"
        "hp.register_controller('stand-for-a-verdict', lambda data: Stand())\n"
    )
    names: dict[str, object] = {}
    code = (tmp_path / "own.py").read_text().rsplit("\n", 2)[0]  # without registering it
    exec(compile(code, "own.py", "exec"), names)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, names["Stand"](), duration=0.2, accuracy=1e-2)
    trace.save("stand.nc")
    refused = run("budget", "stand.nc", "--verdict")
    assert (refused.status, refused.out) == (2, "")
    assert "stand-for-a-verdict" in refused.err
    done = run("budget", "stand.nc", "--verdict", "--import", "own.py")
    assert done.status == 0 and "Peaks with a verdict" in done.out


def test_ctrl_c_during_the_verdict_leaves_the_walk(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Status 130, one message; table and trace are there."""

    @contextmanager
    def interrupting(title: str) -> Iterator[Callable[[float], None]]:
        late = title == "computing peaks again"

        def progress(_fraction: float) -> None:
            if late:
                signal.raise_signal(signal.SIGINT)

        progress.stage = lambda _title: None  # type: ignore[attr-defined]
        yield progress

    monkeypatch.setattr("hexapod_pin.commands.progress.progress_bar", interrupting)
    done = run(*WALK, *QUICK, *STEADY, "--verdict")
    assert done.status == 130
    assert done.err.startswith("hexapod-pin: no verdict on the peaks: interrupted after 1 of 3")
    assert "Torque budget of" in done.out
    assert hp.load_trace("walk.nc").time[-1] == pytest.approx(1.2)

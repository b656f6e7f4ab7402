"""Every study that runs many cases goes on after kill -9, to the same bits."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import hexapod_pin as hp
from hexapod_pin.study.judge_peaks import servo_stiffness
from hexapod_pin.study.runs import runner
from hexapod_pin.study.runs.store import RowStore
from hexapod_pin.study.runs.task import case_outcomes

ROOT = Path(__file__).parents[1]
QUICK: dict[str, Any] = {"accuracy": 1e-2}
GAIT = hp.Gait.tripod(stroke=0.03, cycle_time=0.5)

MOTORS = """
schema = 1
[base]
robot = "kharagpur"
gait = { name = "tripod", stroke = 0.03, cycle_time = 0.5 }
duration = 1.5
accuracy = 1e-2
[motors]
voltage = 12.0
models = ["XM430-W350", "XM540-W270", "AX-12A"]
[design]
kind = "latin-hypercube"
samples = 4
seed = 1
"""


@cache
def scene(mu: float = 0.8) -> hp.Scene:
    """Return a robot on level ground."""
    return hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.preset("s2").with_mu(mu))


def walk(lift: float = 0.02) -> hp.Case:
    """Return a short walk."""
    control = hp.KinematicControl(GAIT.with_changes(lift=lift))
    return hp.Case(scene(), control, duration=1.5, **QUICK)


def _compare(**how: Any) -> Any:
    controllers = {f"{x:g}": walk(x).controller for x in (0.01, 0.02, 0.03)}
    scenes = {"rough": scene(0.8), "slippery": scene(0.3)}
    return hp.compare(scenes, controllers, duration=1.5, **QUICK, **how).to_json()


def _peaks(**how: Any) -> Any:
    return hp.study.judge_peaks(walk(), **how).to_dict()


def _stiffness(**how: Any) -> Any:
    return repr(servo_stiffness(walk(), walk().run(), **how))


def _torque_map(**how: Any) -> Any:
    found = hp.torque_map(
        scene(), "straight", strokes=[0.02, 0.03], cycle_times=[0.5, 0.6], check=1, **QUICK, **how
    )
    return plain(found)


def _gait_energy(**how: Any) -> Any:
    gaits = {"tripod": hp.Gait.tripod(), "ripple": hp.Gait.ripple()}
    return plain(
        hp.study.gait_energy(scene(), gaits, [0.1, 0.2], stroke=0.03, check=1, **QUICK, **how)
    )


def _tune(**how: Any) -> Any:
    found = hp.tune(
        lambda values: walk(**values).controller,
        {"lift": 0.02}, {"lift": (0.01, 0.03)}, {"rough": scene(0.8)},
        lambda runs, baseline: float(runs[0].torque_rms.sum()),
        held_out={"slippery": scene(0.3)}, duration=1.5, seed=1, budget=15, population=5,
        **QUICK, **how,
    )  # fmt: skip
    return found.data


def _select(**how: Any) -> Any:
    return hp.select_motors(MOTORS, **how).to_dict()


def plain(grid: Any) -> dict[str, Any]:
    """Return the columns of a grid as text."""
    return {
        name: one.values.tobytes().hex() if one.values.dtype != object else one.values.tolist()
        for name, one in grid.columns().items()
    }


STUDIES: dict[str, Callable[..., Any]] = {
    "compare": _compare,
    "peaks": _peaks,
    "stiffness": _stiffness,
    "torque_map": _torque_map,
    "gait_energy": _gait_energy,
    "tune": _tune,
    "select": _select,
}


def text_of(name: str, **how: Any) -> str:
    """Return what a study comes to, as text."""
    return json.dumps(STUDIES[name](**how), sort_keys=True, default=str)


def run_until(name: str, store: str, share: float, how: dict[str, Any]) -> None:
    """Run a study in this process, and kill it behind a fraction of its cases."""

    def stop(done: float) -> None:
        if done >= share:
            os.kill(os.getpid(), signal.SIGKILL)

    text_of(name, store=store, resume=True, progress=stop, **how)


@cache
def undisturbed(name: str) -> str:
    """Return what a study comes to without a store."""
    return text_of(name)


def kept(store: Path) -> int:
    """Return how many rows a store holds."""
    with RowStore(store, resume=True) as rows:
        return len(rows.finished)


@pytest.mark.parametrize("share", [0.2, 0.6])
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_that_is_killed_goes_on_to_the_same_bits(
    name: str, share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process ends at once behind a fraction of its cases; the next has another thread."""
    store = tmp_path / "rows.db"
    code = "import sys; sys.path[:0] = ['tests']; from tests.test_study_kill import run_until\n"
    code += f"run_until({name!r}, sys.argv[1], {share}, {{'threads': 1}})"
    done = subprocess.run(
        [sys.executable, "-c", code, str(store)],
        cwd=ROOT, timeout=120, check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == -signal.SIGKILL, done.stderr
    before, ran = kept(store), list[Any]()

    def counted(*args: Any) -> Generator[Any, None, None]:
        for outcome in case_outcomes(*args):
            ran.append(outcome)
            yield outcome

    monkeypatch.setattr(runner, "case_outcomes", counted)
    assert text_of(name, store=store, resume=True, threads=2) == undisturbed(name)
    assert before > 0 and len(ran) == kept(store) - before  # no row is run again


def test_worker_processes_give_the_same_bits(tmp_path: Path) -> None:
    store = tmp_path / "rows.db"
    assert text_of("gait_energy", store=store, processes=2) == undisturbed("gait_energy")

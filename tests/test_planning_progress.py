"""Planning a long walk reports how far it is, and Ctrl-C ends it as it ends a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.commands.progress import ProgressBar
from hexapod_pin.control import kinematic as walk_knots
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.simulation.case import run_case
from hexapod_pin.simulation.plant import motion_at

SWAYING = hp.motion.BodyMotion(lateral=hp.motion.Sine(amplitude=0.002, period=3.1))


@pytest.fixture
def case(monkeypatch: pytest.MonkeyPatch) -> hp.Case:
    """A walk that does not repeat, planned in blocks of a tenth of a second."""
    monkeypatch.setattr(walk_knots, "BLOCK_KNOTS", 10)
    gait = hp.Gait.tetrapod(stroke=0.05, cycle_time=2.4)
    control = hp.KinematicControl(gait, body=SWAYING)
    return hp.Case(hp.Scene(hp.load_robot("kharagpur")), control, duration=6.0, accuracy=1e-3)


def test_planning_tells_its_share_before_the_run_begins(case: hp.Case) -> None:
    reports: list[tuple[str, float]] = []
    run_case(
        case,
        lambda share: reports.append(("run", share)),
        lambda share: reports.append(("plan", share)),
    )
    kinds = [kind for kind, _ in reports]
    planned = [share for kind, share in reports if kind == "plan"]
    assert kinds == sorted(kinds)  # "plan" before "run"
    assert len(planned) > 5
    assert planned == sorted(planned)
    assert planned[0] == 0.0
    assert planned[-1] <= 1.0


def test_an_interrupted_plan_is_a_typed_error_without_samples(case: hp.Case) -> None:
    def stop(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    with refused(SimulationInterrupted, trace=None, about=("planned",)):
        run_case(case, planning=stop)


def test_the_command_ends_as_a_run_does_and_leaves_nothing(
    case: hp.Case,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = case.save(tmp_path / "case.toml")

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(ProgressBar, "stage", lambda bar, title: stop)
    with pytest.raises(SystemExit) as caught:
        main(["run", str(path), "--out", str(tmp_path / "run.nc"), "--no-html"])
    assert caught.value.code == 130
    assert "nothing was simulated" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["case.toml"]


def test_a_prescribed_start_is_read_off_the_knots_around_it() -> None:
    """A long plan is not handed over once more for it; the bits are those of the whole plan."""
    from hexapod_pin import native

    gait = hp.Gait.tetrapod(stroke=0.05, cycle_time=2.4)
    plan = hp.KinematicControl(gait).plan(hp.load_robot("kharagpur"), 5.0)
    for time in (0.0, 1e-4, float(plan.time[7]), 1.2345, float(plan.time[-1]), 99.0):
        whole = native.set_points_at(
            time=plan.time.tolist(), position=plan.q, rate=plan.v, kind=plan.kind,
            acceleration=np.zeros((0, 0)), at=time,
        )  # fmt: skip
        angle, rate = motion_at(plan, time)
        assert np.array_equal(angle, whole[0])
        assert np.array_equal(rate, whole[1])

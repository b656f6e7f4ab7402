"""How far peaks depend on assumed servo gains: two more runs, one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.judge_peaks import servo_stiffness

GAIT = hp.Gait.tripod(stroke=0.03, cycle_time=0.4)
LINE = "when the assumed servo stiffness is halved/doubled"


def case_of(**scene: object) -> hp.Case:
    """Return a walk of two steady cycles."""
    robot = hp.load_robot("kharagpur")
    return hp.Case(hp.Scene(robot, **scene), hp.KinematicControl(GAIT), duration=1.6)  # type: ignore[arg-type]


def test_the_changes_are_those_of_runs_with_other_servos() -> None:
    case = case_of()
    trace = case.run()
    effect = servo_stiffness(case, trace, threads=2)
    peak = np.abs(trace.summary.torque_peak).max()
    for found, factor in zip(effect.torque_peak_change, (0.5, 2.0), strict=True):
        other = case_of(servo=case.scene.servos.stiffer(factor)).run().summary
        assert found == pytest.approx(np.abs(other.torque_peak).max() / peak - 1.0, rel=1e-12)
    assert (
        effect.torque_peak_change[0] < 0.0 < effect.torque_peak_change[1]
    )  # stiffer servos: harder touch-downs
    assert effect.failures == ("", "")
    assert effect.line.startswith(f"peak torque changes by {effect.torque_peak_change[0]:+.0%}/")
    assert effect.line.endswith(LINE)


def test_without_servos_there_is_nothing_to_change() -> None:
    case = case_of(prescribed=True)
    with refused(ParameterError, "case", "no servo stiffness"):
        servo_stiffness(case, case.run())


@pytest.mark.parametrize(("more", "printed"), [
    ((), True), (("--quick",), False), (("--kp", "240", "--kd", "4.8"), False),
    (("--prescribed",), False),
])  # fmt: skip
def test_walk_prints_it_of_assumed_gains_unless_quick(
    more: tuple[str, ...], printed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "walk kharagpur --gait tripod --cycle-time 0.4 --stroke 0.03 --duration 1.2 --no-html"
    with pytest.raises(SystemExit) as ended:
        main([*options.split(), "--accuracy", "1e-2", "--out", str(tmp_path / "w.nc"), *more])
    out = capsys.readouterr().out
    assert ended.value.code == 0
    assert (LINE in out) is printed

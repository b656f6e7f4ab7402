"""Stroke, lift and cycle time fitted to a robot; what is given is used or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import fit_gait
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.leg_geometry import leg_length


def kharagpur(folder: Path, old: str, new: str) -> hp.Robot:
    """Return kharagpur with something else in its file."""
    text = hp.urdf_path("kharagpur").read_text()
    assert old in text
    path = folder / "changed.urdf"
    path.write_text(text.replace(old, new))
    return hp.load_robot(path)


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
@pytest.mark.parametrize("gait", ["tripod", "tetrapod", "ripple", "wave"])
def test_built_in_robots_keep_lift_and_cycle(name: str, gait: str) -> None:
    """But for athena's wave, whose coxae would turn at 3.47 of 3.14 rad/s."""
    if (name, gait) == ("athena", "wave"):
        assert fit_gait(hp.load_robot(name), gait).gait.cycle_time == pytest.approx(3.4)
        return
    fitted = fit_gait(hp.load_robot(name), gait)
    assert (fitted.gait.lift, fitted.gait.cycle_time) == (0.02, 2.4)
    assert (fitted.lift, fitted.cycle_time) == ("default", "default")
    if name == "kharagpur":
        assert (fitted.gait.stroke, fitted.stroke) == (0.14, "default")


def test_slow_joints_get_a_longer_cycle_and_the_whole_stroke(tmp_path: Path) -> None:
    """Rates of the plan stay below 80 % of the limit, turning too; 0.2 s less break that."""
    slow = kharagpur(tmp_path, 'velocity="6"', 'velocity="0.524"')
    fitted = fit_gait(slow, "tetrapod")
    assert fitted.gait.stroke == 0.14 and fitted.cycle_time.startswith("chosen")
    cycle = fitted.gait.cycle_time
    assert cycle == pytest.approx(round(cycle, 1), abs=1e-9) and cycle > 2.4
    for other, within in ((cycle, True), (cycle - 0.2, False)):
        gait = fitted.gait.with_changes(cycle_time=other)
        plan = hp.KinematicControl(gait).plan(hp.load_robot("kharagpur"), 4.0 * other)
        assert bool(np.abs(plan.v).max() < 0.8 * 0.524) is within
    slow = kharagpur(tmp_path, 'velocity="6"', 'velocity="1"')
    fitted = fit_gait(slow, "tripod", 0.0, turn_rate=0.1)
    plan = hp.KinematicControl(fitted.gait).plan(slow, 4.0 * fitted.gait.cycle_time)
    assert np.abs(plan.v).max() <= 0.8 * 1.0 * (1.0 + 1e-6)


def test_a_given_cycle_is_used_or_refused(tmp_path: Path) -> None:
    slow = kharagpur(tmp_path, 'velocity="6"', 'velocity="1.8"')
    with refused(GaitError, quantity="cycle_time") as caught:
        fit_gait(slow, "tetrapod", cycle_time=2.4)
    assert 2.4 < caught.value.limit <= 2.8
    assert fit_gait(slow, "tetrapod", cycle_time=2.8).cycle_time == "as given"  # at 95 % of limits
    assert fit_gait(slow, "tetrapod").gait.cycle_time > 2.8


def test_short_legs_lift_less_by_default(tmp_path: Path) -> None:
    """Femora of half the length: 8 % of what a leg then measures."""
    text = hp.urdf_path("kharagpur").read_text()
    small = tmp_path / "small.urdf"
    small.write_text(text.replace('<origin xyz="0.11934 0 0"', '<origin xyz="0.06 0 0"'))
    robot = hp.load_robot(small)
    length = leg_length(robot)
    fitted = fit_gait(robot, "tripod")
    assert fitted.gait.lift == pytest.approx(0.08 * length, rel=1e-12)
    assert fitted.gait.lift < 0.02
    assert fitted.lift.startswith("chosen: 8% of a leg's length")
    assert fit_gait(robot, "tripod", lift=0.02).lift == "as given"

"""`hp.stability`: margins of whole traces, on level and sloping ground, as data and as text."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace, with_run
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.results.stability import MARGINS

RADIUS, HEIGHT = 0.3, 0.1  # of the synthetic trace's hexagon of feet, and of its centre of mass
APOTHEM = RADIUS * math.sqrt(3.0) / 2.0


@pytest.fixture(scope="module")
def walk() -> hp.Trace:
    gait = hp.Gait.tripod(stroke=0.14, cycle_time=2.4)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(gait), duration=7.2)


def with_com(trace: hp.Trace, offset: np.ndarray) -> hp.Trace:
    return replace(trace, com=trace.com + offset)


def test_hexagon_closed_forms() -> None:
    """Six feet on a circle: apothem, corner ahead, corner behind, rise over a side."""
    found = hp.stability(synthetic_trace())
    count = len(found.time)
    assert found.static_margin == pytest.approx(np.full(count, APOTHEM), abs=1e-12)
    assert found.margin_ahead == pytest.approx(np.full(count, RADIUS), abs=1e-12)
    assert found.margin_behind == pytest.approx(np.full(count, RADIUS), abs=1e-12)
    assert found.nesm == pytest.approx(math.hypot(HEIGHT, APOTHEM) - HEIGHT, abs=1e-12)
    assert found.energy_margin == pytest.approx(found.weight * found.nesm)
    assert found.weight == pytest.approx(30.0)
    assert (found.feet_down == 6).all()


def test_lifted_foot_cuts_a_corner() -> None:
    """Without the foot ahead, the side between its neighbours is half a radius ahead."""
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[150:, 0] = 0.0  # the foot on the x axis, from 1.5 s on
    found = hp.stability(replace(trace, foot_force=force))
    least, time = found.least("margin_ahead")
    assert least == pytest.approx(0.5 * RADIUS, abs=1e-12)
    assert time > 1.499
    assert found.margin_ahead[found.time < 1.499] == pytest.approx(RADIUS, abs=1e-12)
    assert found.least("static_margin")[0] == pytest.approx(0.5 * RADIUS, abs=1e-12)
    assert found.feet_down.min() == 5


def test_in_the_air_there_is_no_margin() -> None:
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[200] = 0.0
    found = hp.stability(replace(trace, foot_force=force))
    for name in MARGINS:
        assert found.least(name) == (-math.inf, pytest.approx(2.0))
    assert found.to_dict()["margins"]["nesm"]["least"] is None
    json.loads(found.to_json())


def test_centre_of_mass_outside() -> None:
    """0.4 m to the left of the middle, with a side at the apothem: beyond it by the rest."""
    found = hp.stability(with_com(synthetic_trace(), np.array([0.0, 0.4, 0.0])))
    assert found.static_margin == pytest.approx(APOTHEM - 0.4, abs=1e-12)
    assert found.nesm == pytest.approx(HEIGHT - math.hypot(HEIGHT, 0.4 - APOTHEM), abs=1e-12)
    assert (found.margin_ahead == -math.inf).all()


def test_excursion_of_a_known_path() -> None:
    """Sines of 2, 3 and 5 mm about a line that climbs and goes aside, in whole periods."""
    trace = synthetic_trace(speed=0.0)
    phase = 2.0 * np.pi * trace.time
    waves = np.stack(
        [2e-3 * np.cos(2 * phase), 3e-3 * np.cos(phase), 5e-3 * np.cos(3 * phase)], axis=1
    )
    line = trace.time[:, None] * np.array([0.1, 0.0, 0.02]) + [0.5, -0.2, 0.1]
    found = hp.stability(replace(trace, com=line + waves))
    size = np.ptp(found.excursion, axis=0)
    # the line is fitted to 300 samples of cosines: their ends tilt it by 1 % of the amplitudes
    assert size == pytest.approx([4e-3, 6e-3, 10e-3], rel=0.02)
    assert np.abs(found.excursion.mean(axis=0)).max() < 1e-15


def test_turned_walk_has_the_same_margins() -> None:
    """Everything turned by 90 degrees, the direction of travel with it."""
    trace = with_com(synthetic_trace(speed=0.0), np.array([0.03, 0.02, 0.0]))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(trace, com=trace.com @ turn.T, foot_position=trace.foot_position @ turn.T)
    turned = with_run(turned, travel_direction=(0.0, 1.0))
    before, after = hp.stability(trace), hp.stability(turned)
    for name in MARGINS:
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-14)
    assert before.margin_ahead[0] != pytest.approx(before.margin_behind[0], abs=0.01)


def test_heading_turns_with_the_trunk() -> None:
    """A trunk that has yawed by 180 degrees since the start has ahead where behind was."""
    trace = with_com(synthetic_trace(speed=0.0), np.array([0.05, 0.0, 0.0]))
    q = np.array(trace.q)
    q[1:, 3:7] = [0.0, 0.0, 1.0, 0.0]
    found = hp.stability(replace(trace, q=q))
    assert found.margin_ahead == pytest.approx(RADIUS + 0.05, abs=1e-12)


def test_tilted_gravity_projects_along_itself() -> None:
    """The centre of mass at height h under gravity tilted by a stands h tan a further down."""
    angle = 0.2
    gravity = [9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle)]
    found = hp.stability(synthetic_trace(gravity=gravity))
    shift = HEIGHT * math.tan(angle)
    # the plane of projection is across gravity: lengths along x shrink by cos a
    assert found.margin_ahead == pytest.approx((RADIUS - shift) * math.cos(angle), abs=1e-12)
    assert found.margin_behind == pytest.approx((RADIUS + shift) * math.cos(angle), abs=1e-12)


def test_walk_on_level_ground(walk: hp.Trace) -> None:
    """The planned tripod's least margin is 28.7 mm, where the sides change at one instant.

    A robot that sags stands on six feet for a while: the margin is that of a stroke shorter by up
    to the distance moved meanwhile (factor 2 b / sqrt(a^2 + 4 b^2) = 0.95 of the closed form).
    """
    found = hp.stability(walk)
    exchanges = 2 * found.window.cycles
    overlap = np.mean(found.feet_down > 3) * (found.window.end - found.window.start) / exchanges
    most = 28.7e-3 + 0.95 * 0.14 / 1.2 * overlap
    sway = 1e-3  # m, of the centre of mass
    assert 28.7e-3 - sway < found.least("static_margin")[0] < most + sway
    assert found.least("nesm")[0] > 0.0
    assert found.feet_down.min() == 3
    assert (found.static_margin <= found.longitudinal_margin + 1e-12).all()
    assert found.window.samples == hp.torque_budget(walk).window.samples
    assert len(found.time) == found.window.last - found.window.first + 1
    assert np.abs(found.excursion[:, 1]).max() < 2e-3
    every = hp.stability(walk, whole=True)
    assert len(every.time) == len(walk.time)
    assert every.static_margin.min() <= found.static_margin.min()


def test_slope_lowers_the_margin_behind(walk: hp.Trace) -> None:
    """Uphill the projection moves back by h tan a; lengths in the ground shrink by cos a."""
    angle, robot = 0.1, hp.load_robot("kharagpur")
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.14, cycle_time=2.4))
    tilted = (-9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle))
    uphill = hp.stability(hp.simulate(hp.Scene(robot, gravity=tilted), gait, duration=7.2))
    level = hp.stability(walk)
    height = float(walk.com[-1, 2])
    change = uphill.margin_behind.mean() - level.margin_behind.mean()
    # the walk yields downhill by a few mm more than on the level
    assert change == pytest.approx(-height * math.tan(angle), abs=4e-3)


def test_text_and_data(walk: hp.Trace) -> None:
    """Every margin is in the table with its unit, and in the data with its time."""
    found = hp.stability(walk)
    table, data = found.table(), found.to_dict()
    for name, meaning in MARGINS.items():
        least, time = found.least(name)
        assert f"{1e3 * least:.2f}" in next(x for x in table.splitlines() if meaning in x)
        assert data["margins"][name]["least"] == least
        assert data["margins"][name]["time"] == time
    assert "[mm]" in table and "mean normal force > 0" in table
    assert len(found.to_dict(samples=True)["samples"]["zmp"]) == len(found.time)
    with refused(hp.errors.UnknownNameError, kind="margin", name="margin"):
        found.least("margin")
    with refused(ValueError, about=("read-only",)):
        found.nesm[0] = 1.0


def test_command(walk: hp.Trace, tmp_path: Path) -> None:
    path = walk.save(tmp_path / "walk.nc")
    runner = CliRunner()
    text = runner.invoke(app, ["stability", str(path)]).output
    assert text.strip() == hp.stability(walk).table()
    plain = json.loads(runner.invoke(app, ["stability", str(path), "--json", "--whole"]).output)
    assert plain == hp.stability(walk, whole=True).to_dict()


def test_gravity_is_needed() -> None:
    with refused(hp.errors.ParameterError, "gravity"):
        hp.stability(synthetic_trace(gravity=[0.0, 0.0, 0.0]))

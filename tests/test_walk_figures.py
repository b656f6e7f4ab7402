"""Figures of walks show the numbers of the trace, with S2's signs; their files are compact."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace, with_run

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.view import write_joint_motion_figure
from hexapod_pin.view.balance_figures import draw_mass_center, draw_quasi_static
from hexapod_pin.view.figure_file import compact_svg
from hexapod_pin.view.walk_figures import draw_joint_motion

pytest.importorskip("matplotlib")


def walk(cycle_time: float, duration: float) -> hp.Trace:
    robot = hp.load_robot("kharagpur")
    motion = hp.motion.paper_motion(
        robot, hp.Gait.tetrapod(cycle_time=cycle_time), profile="constant"
    )
    scene = hp.Scene(robot, contact=hp.Contact.s2(), prescribed=True)
    return hp.simulate(scene, motion, duration=duration, accuracy=1e-3, sample=cycle_time / 120)


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    return walk(2.4, 7.2)


@pytest.fixture(scope="module")
def slow() -> hp.Trace:
    """Its window begins a quarter of a cycle late: it is shifted into the other's phase."""
    return with_run(walk(12.0, 27.0), steady_from=15.0, steady_until=27.0)


def curves(axes: object) -> dict[str, np.ndarray]:
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}  # type: ignore[attr-defined]
    return {label: data for label, data in lines.items() if not label.startswith("_")}


def test_joint_motion_is_the_trace_in_degrees_and_signs_of_s2(trace: hp.Trace) -> None:
    figure = draw_joint_motion(trace, ["lf"], cycles=1)
    angle, rate = (list(curves(axes).values()) for axes in figure.axes)
    cycle = slice(120, 241)  # the second cycle
    for k, (joint, sign, less) in enumerate([("coxa", 1, 0), ("femur", -1, 0), ("tibia", 1, 90)]):
        j = trace.joint(f"lf_{joint}_joint")
        np.testing.assert_array_equal(angle[k][:, 0], trace.time[cycle])
        expected = np.degrees(trace.q[cycle, 7 + j])
        np.testing.assert_allclose(angle[k][:, 1], sign * expected - less, atol=1e-12)
        expected = np.degrees(trace.v[cycle, 6 + j])
        np.testing.assert_allclose(rate[k][:, 1], sign * expected, atol=1e-12)
    # S2's own numbers: +-20 degrees, a lift by 6 degrees upwards; the middle of the swing is a
    # sample, and the standing posture is level to 0.01 degrees.
    assert np.abs(angle[0][:, 1]).max() == pytest.approx(20.2, abs=0.1)  # with the blends
    assert angle[1][:, 1].max() == pytest.approx(6.0, abs=0.01)
    assert angle[1][:, 1].min() == pytest.approx(0.0, abs=0.01)
    assert angle[2][:, 1] == pytest.approx(0.0, abs=0.01)


def test_margins_are_those_of_stability_and_polygons_of_the_grounded_feet(trace: hp.Trace) -> None:
    found = hp.stability(trace)
    off, margins, above, *_ = draw_mass_center(trace).axes
    for k, data in enumerate(curves(off).values()):
        np.testing.assert_array_equal(data[:, 1], 1e3 * found.excursion[:, k])
    names = ("static_margin", "zmp_margin", "nesm")
    for name, (label, data) in zip(names, curves(margins).items(), strict=True):
        np.testing.assert_array_equal(data, np.stack([found.time, 1e3 * getattr(found, name)], 1))
        assert f"least {1e3 * found.least(name)[0]:.1f} mm" in label
    np.testing.assert_array_equal(curves(above)["centre of mass"], 1e3 * found.com[:, :2])
    drawn = [data for label, data in curves(above).items() if label.startswith("support")]
    assert [len(data) for data in drawn] == [5, 5, 5]  # S2's tetrapod: four feet, closed
    row = int(np.argmin(np.abs(trace.time - 2.8)))  # legs 2 and 3 in the middle of their swing
    down = [trace.foot(f"{leg}_foot") for leg in "lf lr rm rr".split()]
    feet = 1e3 * trace.foot_position[row][down]
    assert sorted(map(tuple, drawn[0][:-1])) == sorted(map(tuple, feet[:, :2]))


def test_quasi_static_shows_both_speeds_and_their_difference(
    trace: hp.Trace, slow: hp.Trace
) -> None:
    moments = hp.results.joint_moments(trace)
    femur = list(curves(draw_quasi_static(trace, slow, ["lm"]).axes[0]).values())
    last = moments.axis_torque[-120:, moments.joint("lm_femur_joint")]
    np.testing.assert_array_equal(femur[0][:, 1], last)
    np.testing.assert_allclose(femur[2][:, 1], femur[0][:, 1] - femur[1][:, 1], atol=1e-15)
    # Leg 3 swings in the first third: -0.153 N m, its distal weight, at any speed (closed form).
    assert femur[1][10:30, 1] == pytest.approx(-0.153, abs=0.01)


def test_refusals(trace: hp.Trace, slow: hp.Trace, tmp_path: Path) -> None:
    """Files of each figure are written in tests/test_s2_study.py."""
    with refused(ParameterError, "path"):
        write_joint_motion_figure(trace, tmp_path / "figure.jpeg", ["lf"])
    with refused(UnknownNameError, kind="leg", name="tail"):
        draw_joint_motion(trace, ["tail"])
    with refused(ParameterError, "slow", 2.4000000000000004):
        draw_quasi_static(slow, trace)
    with refused(ParameterError, "slow", 12.0):  # coxae stand
        other = np.concatenate([slow.q[:, :7], slow.q[:, 7:][:, (2,) * 18]], axis=1)
        draw_quasi_static(trace, replace(slow, q=other))
    with refused(ParameterError, "Trace.run.robot.urdf"):
        draw_joint_motion(synthetic_trace(urdf=None))


def test_straight_runs_lose_what_lies_on_them() -> None:
    """A line, a corner and a second line: three points remain; letters only lose digits."""
    given = '<path d="M 0 0 L 1 0.05 L 2 0 L 10 0.000001 L 10 4 L 10.09 6 L 10 9"/>'
    assert compact_svg(given) == '<path d="M 0 0 L 10 0 L 10 9"/>'
    closed = '<path d="M 0 0.123456 \nL 0.0200001 0 \nL 1 1 \nz\n"/>'
    assert compact_svg(closed) == '<path d="M 0 0.12 L 0.02 0 L 1 1 z"/>'
    curved = '<path d="M 0 0 C 1 1 2 2.5 3 3"/>'
    assert compact_svg(curved) == curved

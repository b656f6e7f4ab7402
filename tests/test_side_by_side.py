"""Pages of several runs: each whole, by name, bands of further runs, and the picture's middle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from browser import opened, settled
from page_data import Loads, PageData
from refusals import refused
from scipy.spatial import ConvexHull
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import write_html, write_side_by_side
from hexapod_pin.view.ground_shapes import Sizes, ground_rectangle, middle
from hexapod_pin.view.html import live_viewer, page_text


@pytest.fixture(scope="module")
def traces() -> dict[str, Trace]:
    return {
        "plain": synthetic_trace(duration=1.0, speed=0.4),
        "slow": synthetic_trace(duration=1.0, speed=0.1),
        "short": synthetic_trace(duration=0.5, speed=0.4),
    }


def test_every_run_is_whole_in_the_page(traces: Any, tmp_path: Path) -> None:
    data = PageData(write_side_by_side(traces, tmp_path / "runs.html").read_text())
    assert [run["name"] for run in data.runs] == list(traces)
    for k, trace in enumerate(traces.values()):
        np.testing.assert_allclose(data.channel("place", k), trace.q[:, :3], atol=5.1e-6)
        np.testing.assert_allclose(data.channel("time", k)[:, 0], trace.time, atol=5.1e-7)
    odd = "</script><img src=x>"
    path = write_side_by_side({odd: traces["plain"], "b": traces["short"]}, tmp_path / "runs.html")
    page = path.read_text(encoding="utf-8")
    one = write_html(traces["plain"], tmp_path / "one.html").read_text(encoding="utf-8")
    assert Loads(page).policy == Loads(one).policy and "<img" not in page
    assert len(list(tmp_path.iterdir())) == 2  # nothing else left


def aside(x: float, y: float) -> Trace:
    """A glide along x at 0.1 m/s, feet on a circle of 0.3 m around a point beside the trunk."""
    trace = synthetic_trace(duration=1.0)
    return replace(trace, foot_position=trace.foot_position + np.array([x, y, 0.0]))


def test_a_frame_aside_of_the_feet_moves_the_picture_to_them() -> None:
    """The reach is that of the feet around their mean, 0.3 m, and the ground lies around it."""
    trace = aside(0.08, 0.0)  # up to 0.3 of 0.3 m is within
    np.testing.assert_array_equal(middle(trace, np.arange(101)), trace.q[:, :2])
    trace = aside(0.5, 0.2)
    sizes = Sizes.of(trace, None)
    assert sizes.reach == pytest.approx(0.3)
    np.testing.assert_allclose(middle(trace, np.array([0, 100])), [(0.5, 0.2), (0.6, 0.2)])
    low, high, spacing = ground_rectangle(trace, sizes)
    np.testing.assert_allclose(0.5 * (low + high), (0.55, 0.2), atol=spacing)
    # a quarter turn to the left takes 0.5 m ahead to 0.5 m to the left
    trace = aside(0.5, 0.0)
    q = np.array(trace.q)
    q[50:, 5] = q[50:, 6] = np.sqrt(0.5)
    [turned] = middle(replace(trace, q=q), np.array([100]))
    np.testing.assert_allclose(turned, (0.1, 0.5), atol=1e-12)


# Further runs of a case: bands of its plots, against numpy on the traces.

MUS = (0.7, 0.05, 0.3, 0.12)


@pytest.fixture(scope="module")
def rubs() -> list[Trace]:
    """A walk of 1.6 s on four frictions, on two of which feet slide; the first is played."""
    scene, gait = hp.Scene(hp.load_robot("kharagpur")), hp.Gait.tripod(stroke=0.06, cycle_time=0.8)
    found = []
    for mu in MUS:
        friction = hp.contact.StickSlip(mu=mu, mu_dynamic=mu, stiffness=2e4, damping=60.0)
        contact = hp.Contact(normal=scene.contact.normal, friction=friction)
        one, control = replace(scene, contact=contact), hp.KinematicControl(gait)
        found.append(hp.simulate(one, control, duration=1.6, estimate=False))
    return found


def test_the_page_holds_the_samples_of_every_run(rubs: list[Trace], tmp_path: Path) -> None:
    """Each within half of its own resolution, so that a band is; and what differs in words."""
    path = write_side_by_side({"a": rubs[1], "b": rubs[0]}, tmp_path / "a.html",
                              spread={"b": rubs[1:]})  # fmt: skip
    data = PageData(path.read_text(encoding="utf-8"))
    assert "spread" not in data.runs[0]
    spread = data.runs[1]["spread"]
    for run, trace in zip(spread["runs"], rubs[1:], strict=True):
        for name, values in (("torque", trace.torque), ("speed", trace.v[:, 6:])):
            place = run["channels"][name]
            bound = 0.501 * data.plain["table"][place]["resolution"]
            np.testing.assert_allclose(data.arrays[place], values, atol=bound, rtol=0.0)
    listed = ", ".join(f"{mu:g}" for mu in MUS)
    assert f"contact friction mu ({listed})" in spread["differ"]
    assert spread["differ"].startswith("they differ in ") and "digest" not in spread["differ"]


def test_bands_are_drawn_and_read_at_the_cursor(
    browser: Any, rubs: list[Trace], tmp_path: Path
) -> None:
    def extremes(values: Any) -> tuple[np.ndarray, np.ndarray]:
        return np.min([*map(values, rubs)], axis=0), np.max([*map(values, rubs)], axis=0)

    path = write_html(rubs[0], tmp_path / "walk.html", spread=rubs[1:])
    page = opened(browser, path, "#t=0.5&joint=lf_femur")
    settled(page)
    opening = "playback.plots.forEach((plot) => { plot.box.open = plot.stale = true; })"
    page.evaluate(f"{opening}, playback.draw()")
    j = rubs[0].joint("lf_femur_joint")
    expected = {
        "Torque": ("lf", lambda t: t.torque[:, j], 5.1e-4),
        "Static stability margin":
            ("margin", lambda t: 1e3 * hp.stability(t, whole=True).static_margin, 6e-3),
    }  # fmt: skip
    found = page.evaluate(
        """() => Object.fromEntries(playback.plots.filter((plot) => plot.series).map((plot) => {
        const of = ({name, shown}) => [name, shown && [...shown.low, ...shown.high]];
        return [plot.title, Object.fromEntries(plot.values.map(of))];
        }))"""
    )
    count = len(rubs[0].time)
    assert all(any(title.values()) for title in found.values())  # every plot over time has a band
    for title, (name, values, bound) in expected.items():
        total = len(found[title][name]) // 2  # samples, and states kept of peaks
        low, high = found[title][name][:count], found[title][name][total:][:count]
        least, most = extremes(values)
        np.testing.assert_allclose(low, least, atol=bound, rtol=1e-3, err_msg=title)
        np.testing.assert_allclose(high, most, atol=bound, rtol=1e-3, err_msg=title)
    # The readout, at the sample of the widest band.
    least, most = extremes(lambda t: t.torque[:, j])
    at = int(np.argmax(most - least))
    page.evaluate("(t) => playback.seek(t)", float(rubs[0].time[at]))
    settled(page)
    keys = page.locator(".panel", has_text="Torque").locator(".keys span.on").first
    value, low, _, high = keys.inner_text().split()[1:]
    shown = [float(text.strip("()")) for text in (value, low, high)]
    assert shown == pytest.approx([rubs[0].torque[at, j], least[at], most[at]], abs=1.01e-3)
    assert page.evaluate("playback.values().band") == pytest.approx([least[at], most[at]], abs=6e-4)
    assert not page.faults
    page.close()


def test_runs_that_cannot_be_compared_are_refused(tmp_path: Path) -> None:
    path, plain = tmp_path / "page.html", synthetic_trace(duration=1.0)
    with refused(ParameterError, "spread[1].time"):
        write_html(plain, path, spread=[plain, synthetic_trace(duration=0.5)])
    shifted = replace(plain, time=plain.time * 1.001)
    with refused(ParameterError, "spread[0].time"), live_viewer(plain, spread=[shifted]):
        pass
    other = replace(plain, joint_names=tuple(f"x_{name}" for name in plain.joint_names))
    with refused(ParameterError, "spread['a'][0].joint_names"):
        write_side_by_side({"a": plain}, path, spread={"a": [other]})
    with refused(ParameterError, "spread", "b"):
        write_side_by_side({"a": plain}, path, spread={"b": [plain]})
    q = np.array(plain.q)
    q[50] = np.nan
    with refused(ViewerError, about=("spread[0]", "finite")):
        write_html(plain, path, spread=[replace(plain, q=q)])
    with refused(ViewerError, about=("run 'slow': q", "finite", "50", "0.5")):
        write_side_by_side({"a": plain, "slow": replace(plain, q=q)}, path)
    with refused(ParameterError, "traces"):
        write_side_by_side({}, path)
    assert not path.exists()


# What a page answers about a pushed walk; each of its numbers is found again otherwise.


def test_the_questions_of_a_user_are_answered_by_the_page() -> None:
    """Closest to its limit, least stable, what slips, and what the push does."""
    push = hp.Push("base_link", force=(0.0, 30.0, 0.0), start=0.6, duration=0.1)
    scene = hp.Scene(hp.load_robot("kharagpur"), loads=(push,))
    walk = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.07, cycle_time=1.2))
    trace = hp.simulate(scene, walk, duration=3.7, estimate=False)
    motor, budget = load_catalog().get("AX-12A"), hp.torque_budget(trace)
    [run] = PageData(page_text({"": trace}, motor=motor)).runs
    rows = {row["key"]: row for row in run["worst"]}
    inside = trace.time >= budget.window.start - 1e-9
    inside &= trace.time <= budget.window.end + 1e-9

    share = hp.motor_budget(trace, motor).derating
    signed = np.sign(trace.torque) * trace.v[:, 6:] / motor.no_load_speed
    use = np.abs(trace.torque) / (share.peak * motor.stall_torque * (share.voltage - signed))
    at, joint = np.unravel_index(int(np.argmax(use * inside[:, None])), use.shape)
    row = max((row for key, row in rows.items() if key.endswith(" use") and "push" not in key),
              key=lambda row: row["value"])  # fmt: skip
    assert (row["joint"], row["time"]) == (joint, pytest.approx(trace.time[at], abs=1e-9))
    assert row["value"] == pytest.approx(use[at, joint], rel=1e-9)
    pushed = trace.time >= 0.6 - 1e-9
    assert rows["push torque"]["value"] == pytest.approx(np.abs(trace.torque[pushed]).max())
    assert rows["push use"]["value"] == pytest.approx(use[pushed].max())

    def margin(k: int) -> float:  # on level ground, by Qhull [m]
        hull = ConvexHull(trace.foot_position[k, trace.contact[k].astype(bool), :2])
        return float(-(hull.equations[:, :2] @ trace.com[k, :2] + hull.equations[:, 2]).max())

    least, at = rows["margin"]["value"], np.searchsorted(trace.time, rows["margin"]["time"] - 1e-9)
    assert least == pytest.approx(margin(int(at)), abs=1e-9)
    assert min(margin(int(k)) for k in np.flatnonzero(inside)[::5]) >= least - 1e-9

    steady = {row["key"]: row["value"] for row in run["steady"]}
    assert steady["speed"] == pytest.approx(budget.measured_speed, rel=1e-9)
    assert steady["femur RMS torque"] == pytest.approx(budget.kind("femur").rms.torque_rms)
    slides, moved = steady["slip of all feet over the way"], sliding(trace, inside)
    assert slides == pytest.approx(moved, rel=0.01)
    assert f"{100.0 * slides:.2g} % of the steady way" in dict(run["facts"])["slip"]


def sliding(trace: hp.Trace, inside: np.ndarray) -> float:
    """Return what the contact points move on the ground, all feet, per metre [m/m].

    By Pinocchio's velocities at the samples: of the sphere's centre and of its rolling.
    """
    model = pin.buildModelFromXML(trace.run.robot.urdf, pin.JointModelFreeFlyer())
    order = [trace.joint_names.index(name) for name in model.names[2:]]
    data, rows = model.createData(), np.flatnonzero(inside)
    speed = np.zeros((len(rows), len(trace.foot_names)))
    for i, k in enumerate(rows):
        q = np.concatenate([trace.q[k, :7], trace.q[k, 7:][order]])
        v = np.concatenate([trace.v[k, :6], trace.v[k, 6:][order]])
        pin.forwardKinematics(model, data, q, v)
        for f in np.flatnonzero(trace.contact[k]):
            frame = model.getFrameId(trace.foot_names[f])
            motion = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            down = (0.0, 0.0, -trace.run.robot.radii(len(trace.foot_names))[f])
            speed[i, f] = np.linalg.norm((motion.linear + np.cross(motion.angular, down))[:2])
    path = np.linalg.norm(np.diff(trace.q[rows[[0, -1]], :2], axis=0))
    return float(np.trapezoid(speed.sum(axis=1), trace.time[rows]) / path)

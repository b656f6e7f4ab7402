"""Five questions of a user, answered from what a page shows; each number is found again otherwise.

Run with `-s` it prints clicks, seconds, answers, and the numbers of both ways.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from browser import opened, settled
from scipy.spatial import ConvexHull

import hexapod_pin as hp
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.html import page_text

MOTOR = "AX-12A"


@pytest.fixture(scope="module")
def runs() -> dict[str, Trace]:
    """A walk that is pushed before its steady cycles, and two gaits undisturbed."""
    robot = hp.load_robot("kharagpur")
    push = hp.Push("base_link", force=(0.0, 30.0, 0.0), start=0.6, duration=0.1)
    tetrapod = hp.Gait.tetrapod(stroke=0.07, cycle_time=1.2)
    ripple = hp.Gait.ripple(stroke=0.07, cycle_time=1.2)
    cases = {
        "pushed": (hp.Scene(robot, loads=(push,)), tetrapod, 3.7),
        "tetrapod": (hp.Scene(robot), tetrapod, 3.6),
        "ripple": (hp.Scene(robot), ripple, 3.6),
    }
    return {
        name: hp.simulate(scene, hp.KinematicControl(gait), duration=duration, estimate=False)
        for name, (scene, gait, duration) in cases.items()
    }


def test_five_questions_are_answered_by_the_page(
    browser: Any,
    runs: dict[str, Trace],
    tmp_path: Path,
) -> None:
    """At most one click each; the number shown is that of the trace."""
    asked: list[tuple[str, int, float, str, float, float]] = []

    def answer(question: str, clicks: int, began: float, text: str, number: float, other: float,
               tolerance: float) -> None:  # fmt: skip
        asked.append((question, clicks, time.monotonic() - began, text, number, other))
        assert number == pytest.approx(other, abs=tolerance), question

    trace, motor = runs.pop("pushed"), load_catalog().get(MOTOR)
    path = tmp_path / "walk.html"
    path.write_text(page_text({"": trace}, motor=motor))
    page = opened(browser, path)
    share = hp.motor_budget(trace, motor).derating
    window = hp.torque_budget(trace).window
    inside = (trace.time >= window.start - 1e-9) & (trace.time <= window.end + 1e-9)

    began = time.monotonic()
    rows = [row.split("\t") for row in page.locator("#worst").inner_text().splitlines()]
    steady = [r for r in rows if r[2].endswith(" use of limit") and not r[2].startswith("push")]
    row = max(steady, key=lambda r: float(r[4].split()[0]))
    page.locator("#worst button").nth(int(row[0]) - 1).click()
    settled(page)
    shown = page.locator("#card").inner_text()
    signed = np.sign(trace.torque) * trace.v[:, 6:] / motor.no_load_speed
    line = share.peak * motor.stall_torque * (share.voltage - signed)
    use = np.abs(trace.torque) / line * inside[:, None]
    at, joint = np.unravel_index(int(np.argmax(use)), use.shape)
    assert trace.joint_names[joint].removesuffix("_joint") in shown
    assert float(row[1].split()[0]) == pytest.approx(trace.time[at], abs=5.1e-4)
    answer("closest to its limit", 1, began, " ".join(row[1:]), float(row[4].split()[0]),
           100.0 * use[at, joint], 0.51)  # fmt: skip

    began = time.monotonic()
    page.locator("#about summary").click()
    name = page.locator("#about dt", has_text="slip")
    text = name.locator("xpath=following-sibling::dd[1]").inner_text()
    page.locator("#about summary").click()
    moved = sliding(trace, inside)
    answer("does it slip", 1, began, text, float(text.split()[0]), 100.0 * moved, 10.0 * moved)

    began = time.monotonic()
    [row] = [r for r in rows if r[2] == "stability margin"]
    page.locator("#worst button").nth(int(row[0]) - 1).click()
    settled(page)
    margins = {int(k): margin_by_qhull(trace, int(k)) for k in np.flatnonzero(inside)[::5]}
    at = int(np.argmin(np.abs(trace.time - float(row[1].split()[0]))))
    assert min(margins.values()) >= 1e-3 * float(row[4].split()[0]) - 5.1e-5
    answer("least stable", 1, began, " ".join(row[1:]), float(row[4].split()[0]),
           1e3 * margin_by_qhull(trace, at), 0.051)  # fmt: skip

    began = time.monotonic()
    [row] = [r for r in rows if r[2] == "push: torque"]
    page.locator("#worst button").nth(int(row[0]) - 1).click()
    after = np.abs(trace.torque[trace.time >= 0.6 - 1e-9])
    answer("what the push does", 1, began, " ".join(row[1:]), float(row[4].split()[0]),
           after.max(), 5.1e-4)  # fmt: skip
    [row] = [r for r in rows if r[2] == "push: use of limit"]
    after = (np.abs(trace.torque) / line)[trace.time >= 0.6 - 1e-9]
    answer("which share of the limit it takes", 0, began, " ".join(row[1:]),
           float(row[4].split()[0]), 100.0 * after.max(), 0.51)  # fmt: skip

    assert not page.faults
    page.close()
    path = tmp_path / "gaits.html"
    path.write_text(page_text(runs))
    pair = opened(browser, path)
    began = time.monotonic()
    table = [row.split("\t") for row in pair.locator("#worst").inner_text().splitlines()]
    [row] = [r for r in table if len(r) > 2 and r[2] == "femur torque"]
    peaks = []
    for run in runs.values():
        femurs = [k for k, name in enumerate(run.joint_names) if "femur" in name]
        own = hp.torque_budget(run).window
        counted = (run.time >= own.start - 1e-9) & (run.time <= own.end + 1e-9)
        peaks.append(np.abs(run.torque[np.ix_(counted, femurs)]).max())
    change = float(row[-1].split()[0].replace("\u2212", "-"))
    assert peaks[1] < peaks[0] and change < 0.0
    answer("the gentler gait", 0, began, " ".join(row[1:]), change,
           100.0 * (peaks[1] / peaks[0] - 1.0), 1.0)  # peaks of steps are higher  # fmt: skip
    budgets = [hp.torque_budget(run) for run in runs.values()]
    for what, values in (
        ("speed", [1e3 * (b.measured_speed or 0.0) for b in budgets]),
        ("femur RMS torque", [next(k for k in b.kinds if k.kind == "femur").rms.torque_rms
                              for b in budgets]),
        ("cost of transport, absolute work", [b.cost_of_transport for b in budgets]),
    ):  # fmt: skip
        [row] = [r for r in table if len(r) > 2 and r[2] == what]
        shown = [float(cell.split()[0].replace("\u2212", "-")) for cell in row[4:7]]
        assert shown[:2] == pytest.approx(values, rel=2e-3)
        assert shown[2] == pytest.approx(100.0 * (values[1] / values[0] - 1.0), abs=0.06)
    assert not pair.faults
    pair.close()
    for question, clicks, seconds, text, number, other in asked:
        print(f"{question}: {clicks} clicks, {seconds:.1f} s: {text} | {number:g} / {other:.5g}")


def sliding(trace: Trace, inside: np.ndarray) -> float:
    """Return what the contact points move on the ground, all feet, per metre [m/m].

    By Pinocchio's velocities at the samples: of the sphere's centre and of its rolling.
    """
    model = pin.buildModelFromXML(trace.run.robot.urdf, pin.JointModelFreeFlyer())
    order = [trace.joint_names.index(name) for name in model.names[2:]]
    data, radii = model.createData(), trace.run.robot.radii(len(trace.foot_names))
    rows = np.flatnonzero(inside)
    speed = np.zeros((len(rows), len(trace.foot_names)))
    frames = [model.getFrameId(name) for name in trace.foot_names]
    for i, k in enumerate(rows):
        q = np.concatenate([trace.q[k, :7], trace.q[k, 7:][order]])
        v = np.concatenate([trace.v[k, :6], trace.v[k, 6:][order]])
        pin.forwardKinematics(model, data, q, v)
        for f, frame in enumerate(frames):
            if trace.contact[k, f]:
                motion = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
                point = motion.linear + np.cross(motion.angular, (0.0, 0.0, -radii[f]))
                speed[i, f] = np.linalg.norm(point[:2])
    time_inside = trace.time[rows]
    path = np.linalg.norm(np.diff(trace.q[rows[[0, -1]], :2], axis=0))
    return float(np.trapezoid(speed.sum(axis=1), time_inside) / path)


def margin_by_qhull(trace: Trace, k: int) -> float:
    """Return the static stability margin of a sample on level ground, by Qhull [m]."""
    hull = ConvexHull(trace.foot_position[k, trace.contact[k].astype(bool), :2])
    return float(-(hull.equations[:, :2] @ trace.com[k, :2] + hull.equations[:, 2]).max())

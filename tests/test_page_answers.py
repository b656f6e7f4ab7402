"""What a page answers about a pushed walk; each of its numbers is found again otherwise."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from page_data import PageData
from scipy.spatial import ConvexHull

import hexapod_pin as hp
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.view.html import page_text


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

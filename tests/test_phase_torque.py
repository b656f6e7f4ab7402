"""Torques of retraction and protraction: known signals, whole walks, names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from synthetic import FEET, JOINTS, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.results.phase_torque import PROTRACTION, RETRACTION


def alternating() -> hp.Trace:
    """Return a trace whose foot lm is down for 0.6 of each second; its femur then gives 2, else 1.

    All other joints give their number in the list.
    """
    trace = synthetic_trace()
    down = np.mod(trace.time - 1e-9, 1.0) < 0.6
    force, torque = np.array(trace.foot_force), np.tile(np.arange(18.0), (len(trace.time), 1))
    force[~down, 1] = 0.0
    torque[:, JOINTS.index("lm_femur_joint")] = np.where(down, -2.0, 1.0)
    return replace(trace, foot_force=force, torque=torque)


def test_known_signals() -> None:
    """Constant within a phase: peak, p99 and RMS are that constant; shares are 0.6 and 0.4."""
    found = hp.results.phase_torques(alternating())
    for phase, size, share in ((RETRACTION, 2.0, 0.6), (PROTRACTION, 1.0, 0.4)):
        row = found.row("lm_femur_joint", phase)
        assert (row.torque_peak, row.torque_p99, row.torque_rms) == pytest.approx((size,) * 3)
        assert row.share == pytest.approx(share, abs=1e-9)
        assert (row.foot, row.kind) == ("lm_foot", "femur")
    row = found.row("rr_tibia_joint", RETRACTION)
    assert (row.torque_peak, row.share) == pytest.approx((17.0, 1.0))


def test_a_phase_that_does_not_occur_has_no_numbers() -> None:
    found = hp.results.phase_torques(alternating())
    row = found.row("lf_coxa_joint", PROTRACTION)
    assert row.share == 0.0
    assert row.torque_peak is None and row.moment_rms is None
    assert " - " in next(
        x for x in found.table().splitlines() if x.startswith("lf_coxa_joint   protraction")
    )


def test_every_joint_belongs_to_its_leg() -> None:
    found = hp.results.phase_torques(alternating())
    assert [row.joint for row in found.rows[::2]] == list(JOINTS)
    assert [row.foot for row in found.rows[::6]] == list(FEET)
    for row in found.rows:
        assert row.joint[:2] == row.foot[:2]
        assert f"_{row.kind}_" in row.joint


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
def test_walk(name: str) -> None:
    """Stance bears the load: its femur peaks are larger; shares are near the duty; RMS add up."""
    gait = hp.Gait.tetrapod(stroke=0.1, cycle_time=1.2)
    scene = hp.Scene(hp.load_robot(name))
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=3.6)
    found, budget, moments = (
        hp.results.phase_torques(trace),
        hp.torque_budget(trace),
        hp.results.joint_moments(trace),
    )
    for leg in ("lf", "lm", "lr", "rf", "rm", "rr"):
        stance = found.row(f"{leg}_femur_joint", RETRACTION)
        swing = found.row(f"{leg}_femur_joint", PROTRACTION)
        assert stance.torque_rms > 1.5 * swing.torque_rms
        assert stance.share + swing.share == pytest.approx(1.0)
        # the planned lift is slow at first: feet leave the ground a little later than planned
        assert stance.share == pytest.approx(gait.duty, abs=0.06)
        assert stance.moment_peak >= stance.torque_peak * 0.95
        mean_square = sum(row.share * row.torque_rms**2 for row in (stance, swing))
        whole = budget.joint(f"{leg}_femur_joint").torque_rms
        assert np.sqrt(mean_square) == pytest.approx(whole, rel=0.01)  # gathered at steps
        j = moments.joint(f"{leg}_femur_joint")
        peak = max(stance.moment_peak, swing.moment_peak)
        assert peak == moments.moment[:, j].max()


def test_names_that_do_not_exist() -> None:
    found = hp.results.phase_torques(alternating())
    known = ["retraction", "protraction"]
    with refused(UnknownNameError, kind="phase", name="swing", known=known):
        found.row("lm_femur_joint", "swing")
    with refused(UnknownNameError, kind="joint", name="knee"):
        found.row("knee", RETRACTION)
    assert len(found.to_dict()["rows"]) == 36

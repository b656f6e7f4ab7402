"""A run in parts, each from the checkpoint of the one before, is the run in one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.benchmark.work_precision.scenes import walk
from hexapod_pin.validation.cases.mirror import SampledMotion, base_run, restarted
from hexapod_pin.validation.solver_setting import CaseRun, SolverSetting

SAME_BITS = [
    SolverSetting("implicit-euler", 1e-3),
    SolverSetting("robust", 1e-3),
    SolverSetting("rk4", 5e-5),
    SolverSetting("extrapolated-euler", 1e-4),  # where parts end at jumps of the set-points
    SolverSetting("dop853", 1e-4),
]
TIGHT = SolverSetting("extrapolated-euler", 1e-7)


@pytest.mark.parametrize("way", [*SAME_BITS[:3], SAME_BITS[4], TIGHT], ids=str)
def test_a_drop_in_parts(way: SolverSetting) -> None:
    """Steps of the last pass over the ends of parts: within the accuracy over 0.03 s."""
    run = base_run()
    apart = SampledMotion.of(run.by(way)).apart(restarted(run, way, 5))
    assert 0.0 < apart < 3.3e-6 if way == TIGHT else apart == 0.0


@pytest.mark.parametrize("way", [SAME_BITS[0], SAME_BITS[1], SAME_BITS[3]], ids=str)
def test_contacts_remember(way: SolverSetting) -> None:
    """Bristles, touch speeds and held set-points are part of the state: without them other bits."""
    task = walk(0.4)
    contact = hp.Contact(
        normal=hp.contact.Restitution(stiffness=1e6, restitution=0.3),
        friction=hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
    )
    scene = replace(task.scene, contact=contact)
    run = CaseRun(scene, task.initial, 0.4, task.sample, task.controller)
    whole = SampledMotion.of(run.by(way))
    assert whole.apart(restarted(run, way)) == 0.0
    half = CaseRun(run.scene, run.start, 0.2, run.sample, run.controller).by(way)
    stand = half.checkpoint
    assert np.abs(stand.contacts[:, :4]).max() > 0.0
    empty = replace(stand, contacts=np.zeros((0, 6)))
    rest = CaseRun(run.scene, empty, 0.2, run.sample, run.controller).by(way)
    # stretches of some 0.1 mm are gone: it has moved when they are back
    assert np.abs(rest.q[-1] - whole.q[-1]).max() > 1e-6


def test_a_saved_trace_goes_on(tmp_path) -> None:
    run, way = base_run(), SolverSetting("dop853", 1e-5)
    first = CaseRun(run.scene, run.start, 0.05, 0.01, run.controller).by(way)
    saved = hp.load_trace(first.save(tmp_path / "half.nc"))
    rest = [
        CaseRun(run.scene, trace.checkpoint, 0.05, 0.01, run.controller).by(way)
        for trace in (first, saved)
    ]
    assert np.array_equal(rest[0].q, rest[1].q) and np.array_equal(rest[0].v, rest[1].v)
    assert rest[0].time == pytest.approx(np.linspace(0.05, 0.1, 6), abs=1e-15)


def test_a_checkpoint_that_does_not_fit_is_refused() -> None:
    stand = base_run().by(SAME_BITS[0]).checkpoint
    broken = replace(stand, q=stand.q[:-1])
    with refused(hp.errors.StateError, about=("(24,)", "(25,)")):
        hp.simulate(base_run().scene, hp.HoldPosture(), duration=0.01, sample=0.01, initial=broken)


@pytest.mark.parametrize("way", SAME_BITS[:2], ids=str)
def test_a_gait_in_parts_whose_ends_are_ends_of_its_plan(way: SolverSetting) -> None:
    """The time of a last step, 3.6 + 1e-3 + ..., is rounded: past the last knot by a bit."""
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    scene, settings = hp.Scene(hp.load_robot("kharagpur")), {"sample": 0.05, **way.arguments}
    whole, stand = hp.simulate(scene, gait, duration=1.8, **settings), None
    for cycle in range(6):
        part = hp.simulate(scene, gait, duration=0.3, initial=stand, **settings)
        stand = part.checkpoint
        assert np.array_equal(part.q[-1], whole.q[6 * (cycle + 1)])
        assert np.array_equal(part.v[-1], whole.v[6 * (cycle + 1)])

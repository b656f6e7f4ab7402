"""A run in parts, each from the checkpoint of the one before, is the run in one."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.benchmark.work_precision.scenes import walk
from hexapod_pin.scene.scene import standing_on
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


def walking(friction: hp.FrictionLaw | None = None) -> CaseRun:
    """The benchmark's walk: drop, then steps, set-points held 10 ms; another friction if given."""
    task = walk(0.4)
    scene = task.scene
    if friction is not None:
        normal = hp.contact.Restitution(stiffness=1e6, restitution=0.3)
        contact = hp.Contact(normal=normal, friction=friction)
        scene = hp.Scene(
            scene.robot, contact=contact, servo=scene.servo, stops=hp.JointStops(stiffness=0)
        )
    return CaseRun(scene, task.initial, 0.4, task.sample, task.controller)


@pytest.mark.parametrize("way", [way for way in SAME_BITS if way != SAME_BITS[3]], ids=str)
def test_a_drop_in_parts(way: SolverSetting) -> None:
    run = base_run()
    assert SampledMotion.of(run.by(way)).apart(restarted(run, way, 5)) == 0.0


def test_a_drop_in_parts_between_whose_ends_steps_are_taken() -> None:
    """Steps pass over the samples at which parts end: the same motion, within the accuracy.

    Velocities have the accuracy over the 0.03 s that their errors are weighed by: 3.3e-6.
    """
    run = base_run()
    assert 0.0 < SampledMotion.of(run.by(TIGHT)).apart(restarted(run, TIGHT, 5)) < 3.3e-6


@pytest.mark.parametrize("way", [SAME_BITS[0], SAME_BITS[1], SAME_BITS[3]], ids=str)
def test_a_walk_in_parts(way: SolverSetting) -> None:
    """Held set-points go on where they were."""
    run = walking()
    assert SampledMotion.of(run.by(way)).apart(restarted(run, way, 4)) == 0.0


@pytest.mark.parametrize("way", [SAME_BITS[0], SAME_BITS[1], SAME_BITS[3]], ids=str)
def test_contacts_remember(way: SolverSetting) -> None:
    """Bristles and touch speeds are part of the state: with them the same bits, without not."""
    run = walking(hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0))
    whole = SampledMotion.of(run.by(way))
    assert whole.apart(restarted(run, way)) == 0.0
    half = CaseRun(run.scene, run.start, 0.2, run.sample, run.controller).by(way)
    stand = half.checkpoint
    assert np.abs(stand.contacts[:, :4]).max() > 0.0
    empty = hp.results.Checkpoint(stand.time, stand.q, stand.v, np.zeros((0, 6)), stand.controller)
    rest = CaseRun(run.scene, empty, 0.2, run.sample, run.controller).by(way)
    # stretches of some 0.1 mm are gone: it has moved when they are back
    assert np.abs(rest.q[-1] - whole.q[-1]).max() > 1e-6


def test_times_go_on() -> None:
    run = base_run()
    first = CaseRun(run.scene, run.start, 0.04, 0.01, run.controller).by(SAME_BITS[0])
    second = CaseRun(run.scene, first.checkpoint, 0.03, 0.01, run.controller).by(SAME_BITS[0])
    assert second.time == pytest.approx([0.04, 0.05, 0.06, 0.07], abs=1e-15)
    assert second.time[0] == first.time[-1]


def test_a_saved_trace_goes_on(tmp_path) -> None:
    run, way = base_run(), SolverSetting("dop853", 1e-5)
    first = CaseRun(run.scene, run.start, 0.05, 0.01, run.controller).by(way)
    saved = hp.load_trace(first.save(tmp_path / "half.nc"))
    rest = [
        CaseRun(run.scene, trace.checkpoint, 0.05, 0.01, run.controller).by(way)
        for trace in (first, saved)
    ]
    assert np.array_equal(rest[0].q, rest[1].q) and np.array_equal(rest[0].v, rest[1].v)
    assert SampledMotion.of(run.by(way)).apart(restarted(run, way)) == 0.0


def test_a_walk_goes_on_where_it_was_cut() -> None:
    """Knots of `KinematicControl` do not depend on the horizon; times of steps are rounded."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4))
    scene = hp.Scene(robot)
    start = standing_on(scene, control.plan(robot, 1.0).q[0])
    run = CaseRun(scene, start, 1.2, 0.1, control)
    way = SAME_BITS[0]
    assert SampledMotion.of(run.by(way)).apart(restarted(run, way, 3)) < 1e-14


def test_a_checkpoint_that_does_not_fit_is_refused() -> None:
    stand = base_run().by(SAME_BITS[0]).checkpoint
    broken = hp.results.Checkpoint(
        stand.time, stand.q[:-1], stand.v, stand.contacts, stand.controller
    )
    with refused(hp.errors.StateError, about=("(24,)", "(25,)")):
        hp.simulate(base_run().scene, hp.HoldPosture(), duration=0.01, sample=0.01, initial=broken)


@pytest.mark.parametrize("way", [SAME_BITS[0], SAME_BITS[1], TIGHT], ids=str)
def test_a_gait_in_parts_whose_ends_are_ends_of_its_plan(way: SolverSetting) -> None:
    """The time of a last step, 3.6 + 1e-3 + ..., is rounded: past the last knot by a bit.

    With steps over samples the parts have the accuracy, of velocities 0.03 s less: 3.3e-6.
    """
    scene = hp.Scene(hp.load_robot("kharagpur"))
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))

    def walked(duration: float, start: hp.results.Checkpoint | None = None) -> hp.Trace:
        return hp.simulate(
            scene, gait, duration=duration, initial=start, sample=0.05, **way.arguments,
        )  # fmt: skip

    whole, part = walked(1.8), None
    for cycle in range(6):
        part = walked(0.3, None if part is None else part.checkpoint)
        apart = (part.q[-1] - whole.q[6 * (cycle + 1)], part.v[-1] - whole.v[6 * (cycle + 1)])
        for difference, allowed in zip(apart, (1e-7, 3.3e-6), strict=True):
            assert np.abs(difference).max() <= (allowed if way == TIGHT else 0.0)

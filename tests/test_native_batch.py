"""Batches of the native core: any number of threads and cases, and the memory of their samples."""

from __future__ import annotations

import sys

import numpy as np

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.simulation.run_settings import RunSettings

SETTINGS = RunSettings.of(0.1, "implicit-euler", None, None, 1e-3, None)


def run_of(stroke: float) -> NativeRun:
    """A walk of 0.1 s that has not begun."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    case = Case(scene, hp.KinematicControl(hp.Gait.tetrapod(stroke=stroke)))
    return open_loop_run(case, SETTINGS)


def test_more_threads_than_cases_give_the_same_bits() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    strokes = (0.08, 0.10, 0.12)
    gaits = [hp.KinematicControl(hp.Gait.tetrapod(stroke=stroke)) for stroke in strokes]
    cases = [Case(scene, gait) for gait in gaits]
    many = hp.simulate_batch(cases, duration=0.2, threads=1000)
    for case, found in zip(cases, many, strict=True):
        alone = hp.simulate(scene, case.controller, duration=0.2)
        assert np.array_equal(found.q, alone.q) and np.array_equal(found.torque, alone.torque)


def test_an_empty_batch_is_done() -> None:
    assert hp.simulate_batch([], duration=0.1, threads=4) == []


def test_an_abandoned_batch_ends() -> None:
    """A caller may stop taking results; the case that cannot be planned came first."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    good = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.1))
    impossible = hp.HoldPosture(np.full(18, 9.0))
    done = hp.simulation.iterate_batch(
        [Case(scene, good), Case(scene, impossible)], duration=60.0, threads=2
    )
    index, error = next(done)
    assert index == 1 and isinstance(error, hp.errors.ParameterError)
    done.close()


def test_a_batch_holds_a_run_until_it_is_done() -> None:
    rollout, batch = run_of(0.1).rollout, native.Batch(1)
    count = sys.getrefcount(rollout)
    number = batch.add(rollout, 100, 10)
    assert sys.getrefcount(rollout) == count + 1
    assert batch.next_done(0.0)[0] == -2  # patience is over before anything is done
    assert batch.next_done(60.0) == (number, True, "")
    assert sys.getrefcount(rollout) == count


def test_samples_handed_over_are_not_written_again() -> None:
    run = run_of(0.1)
    run.rollout.reserve(100)
    assert run.rollout.advance(40)
    first = run.rollout.record()
    kept = {name: table.copy() for name, table in first.items()}
    again = run.rollout.record()
    assert run.rollout.advance(60)
    whole = run.rollout.record()
    for name, table in kept.items():
        assert np.array_equal(first[name], table) and np.array_equal(again[name], table)
        assert np.array_equal(whole[name][: len(table)], table)
        assert not np.shares_memory(first[name], again[name])
    assert len(whole["time"]) == 101


def test_samples_do_not_depend_on_what_was_reserved() -> None:
    reserved, grown = run_of(0.1), run_of(0.1)
    reserved.rollout.reserve(10_000_000)
    assert reserved.rollout.advance(100) and grown.rollout.advance(100)
    tables = grown.rollout.record()
    for name, table in reserved.rollout.record().items():
        assert np.array_equal(table, tables[name]), name

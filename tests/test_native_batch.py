"""Batches of the native core: how long they hold a run, and the memory of its samples."""

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
    scene = hp.Scene(hp.load_robot("kharagpur"))
    case = Case(scene, hp.KinematicControl(hp.Gait.tetrapod(stroke=stroke)))
    return open_loop_run(case, SETTINGS)


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

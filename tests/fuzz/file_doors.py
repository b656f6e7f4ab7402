"""Doors of files: each draws a damaged or forged one from a seeded generator and reads it."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import replace

import hexapod_pin as hp
from fuzz import material
from fuzz.shown import require_finite
from fuzz.values import odd_data, odd_text
from hexapod_pin.results import RunRecord


def urdf(rng: random.Random) -> None:
    path = material.written("urdf", odd_text(material.urdf_text(), rng))
    material.used(hp.load_robot(path, repair=rng.random() < 0.2))


def xacro(rng: random.Random) -> None:
    path = material.written("xacro", odd_text(material.xacro_text(), rng))
    material.used(hp.load_robot(path))


def hints(rng: random.Random) -> None:
    """A robot with odd hints beside it."""
    path = material.written("urdf", material.urdf_text())
    beside = material.written("hints.toml", odd_text(material.HINTS_TEXT, rng))
    try:
        material.used(hp.load_robot(path))
    finally:
        beside.unlink()


def scene(rng: random.Random) -> None:
    material.used(hp.Scene.from_toml(odd_text(material.scene().to_toml(), rng)))


def case(rng: random.Random) -> None:
    found = hp.Case.from_toml(odd_text(material.case_text(), rng))
    if (found.duration or 0.0) <= 0.02:
        found.with_defaults(limits=material.LIMITS).run()


def study(rng: random.Random) -> None:
    """A study file with changes; its first case is made."""
    found = hp.study.SweepStudy.from_toml(odd_text(material.STUDY_TEXT, rng))
    str(found.case(0))


def catalog(rng: random.Random) -> None:
    path = material.written("csv", odd_text(material.catalog_text(), rng))
    require_finite(hp.load_catalog(path).table())


def _damaged(sound: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are changed or cut off."""
    data = bytearray(sound)
    if rng.random() < 0.3:
        data = data[: rng.randrange(len(data))]
    for _ in range(rng.choice((0, 1, 4, 30)) if data else 0):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def sweep_store(rng: random.Random) -> None:
    path = material.written("db", _damaged(material.store_bytes(), rng))
    found = hp.study.open_sweep(path)
    str((found.dataset, found.reasons, found.pending, found.case_time))


def damaged_trace(rng: random.Random) -> None:
    _read(hp.load_trace(material.written("nc", _damaged(material.trace_bytes(), rng))))


def forged_trace(rng: random.Random) -> None:
    """A trace whose arrays and texts are others, saved with a digest that matches."""
    path = material.new_file("nc")
    try:
        _forged(material.trace(), rng).save(path)
    except (TypeError, ValueError, AttributeError) as error:
        raise hp.errors.TraceFileError(
            str(path), f"no such file can be written ({error})"
        ) from error
    _read(hp.load_trace(path))


def _forged(trace: hp.Trace, rng: random.Random) -> hp.Trace:
    """Return a trace with other numbers or texts."""
    if rng.random() < 0.5:
        run = RunRecord.from_dict(odd_data(trace.run.to_dict(), rng))
        return replace(trace, run=run)
    name = rng.choice(("time", "q", "v", "torque", "foot_force", "foot_gap", "com"))
    array = getattr(trace, name).copy()
    array[rng.randrange(len(array))] = rng.choice((0.0, -1.0, 1e300, 1e10, float("nan")))
    return replace(trace, **{name: array})


def _read(trace: hp.Trace) -> None:
    """Show all that is told of a trace."""
    for use in (hp.stability, hp.walk_verdict, hp.results.phase_torques, hp.torque_budget):
        try:
            found = use(trace)
            shown = found.table() if hasattr(found, "table") else str(found)
        except hp.errors.HexapodError:
            continue
        require_finite(shown)
    str(trace.checkpoint)


def checkpoint(rng: random.Random) -> None:
    """A checkpoint's data with changes, gone on from."""
    data = odd_data(material.trace().checkpoint.to_dict(), rng)
    start = hp.results.Checkpoint.from_dict(data)
    hp.simulate(material.scene(), material.walk(), duration=2e-3, initial=start, estimate=False,
                limits=material.LIMITS)  # fmt: skip


def summary(rng: random.Random) -> None:
    text = json.dumps(odd_data(material.summary_data(), rng), default=str)
    str(hp.load_summary(material.written("json", text)).torque_peak)


FILE_DOORS: tuple[Callable[[random.Random], None], ...] = (
    urdf, xacro, hints, scene, case, study, catalog, damaged_trace, forged_trace, sweep_store,
    checkpoint, summary,
)  # fmt: skip

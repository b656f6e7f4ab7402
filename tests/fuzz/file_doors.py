"""Doors of files: each draws a damaged or forged one from a seeded generator and reads it."""

from __future__ import annotations

import json
import os
import random
from dataclasses import replace
from pathlib import Path

import hexapod_pin as hp
from fuzz import material
from fuzz.shown import require_finite
from fuzz.values import odd_data, odd_text
from hexapod_pin.results import RunRecord


def urdf(rng: random.Random) -> None:
    """A URDF with changes."""
    path = _own_file("urdf")
    path.write_text(odd_text(material.urdf_text(), rng), encoding="utf-8")
    material.used(hp.load_robot(path, repair=rng.random() < 0.2))


def xacro(rng: random.Random) -> None:
    """A xacro file with changes."""
    path = _own_file("xacro")
    path.write_text(odd_text(material.xacro_text(), rng), encoding="utf-8")
    material.used(hp.load_robot(path))


def hints(rng: random.Random) -> None:
    """A robot with odd hints beside it."""
    path = _own_file("hinted.urdf")
    path.write_text(material.urdf_text(), encoding="utf-8")
    path.with_name(f"{os.getpid()}.hints.toml").write_text(
        odd_text(material.HINTS_TEXT, rng), encoding="utf-8"
    )
    material.used(hp.load_robot(path))


def scene(rng: random.Random) -> None:
    """A scene as TOML with changes."""
    from hexapod_pin.scene.scene import Scene

    material.used(Scene.from_toml(odd_text(material.scene().to_toml(), rng)))


def case(rng: random.Random) -> None:
    """A case as TOML with changes."""
    from hexapod_pin.simulation.case import Case

    found = Case.from_toml(odd_text(material.case_text(), rng))
    if (found.duration or 0.0) <= 0.02:
        found.with_defaults(limits=hp.simulation.WorkLimits(evaluations=3e4, steps=1e4)).run()


def study(rng: random.Random) -> None:
    """A study file with changes; its first case is made."""
    found = hp.study.SweepStudy.from_toml(odd_text(material.STUDY_TEXT, rng))
    str(found.case(0))


def catalog(rng: random.Random) -> None:
    """A catalogue of motors with changes."""
    path = _own_file("csv")
    path.write_text(odd_text(material.catalog_text(), rng), encoding="utf-8")
    require_finite(hp.load_catalog(path).table())


def _damaged(sound: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are changed or cut off."""
    data = bytearray(sound)
    if rng.random() < 0.3:
        data = data[: rng.randrange(len(data))]
    for _ in range(rng.choice((0, 1, 4, 30))):
        if data:
            data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def sweep_store(rng: random.Random) -> None:
    """The store of a sweep with bytes changed or cut off."""
    path = _own_file("db")
    path.write_bytes(_damaged(material.store_bytes(), rng))
    found = hp.study.open_sweep(path)
    str((found.dataset, found.reasons, found.pending, found.case_time))


def damaged_trace(rng: random.Random) -> None:
    """A trace's file with bytes changed or cut off."""
    data = _damaged(material.trace_bytes(), rng)
    path = _own_file("nc")
    path.write_bytes(data)
    _read(hp.load_trace(path))


def forged_trace(rng: random.Random) -> None:
    """A trace whose arrays and texts are others, saved with a digest that matches."""
    path = _own_file("nc")
    path.unlink(missing_ok=True)
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
    hp.simulate(material.scene(), material.control(), duration=2e-3, initial=start, estimate=False,
                limits=hp.simulation.WorkLimits(evaluations=3e4, memory=1e8))  # fmt: skip


def summary(rng: random.Random) -> None:
    """A summary's file with changes."""
    path = _own_file("json")
    path.write_text(json.dumps(odd_data(material.summary_data(), rng), default=str), "utf-8")
    found = hp.load_summary(path)
    str(found.torque_peak)


def _own_file(end: str) -> Path:
    """Return a path that no other process uses."""
    return material.folder() / f"{os.getpid()}.{end}"

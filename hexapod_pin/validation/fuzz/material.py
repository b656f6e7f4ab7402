"""Sound things that odd inputs are made from; each is made once in a process."""

from __future__ import annotations

import atexit
import json
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import hexapod_pin as hp


@cache
def robot() -> hp.Robot:
    """Return a robot."""
    return hp.load_robot("kharagpur")


@cache
def scene() -> hp.Scene:
    """Return a scene with loads and stops."""
    loads = [hp.Payload("base_link", mass=0.3, position=(0.0, 0.0, 0.05))]
    return hp.Scene(robot(), loads=loads, stops=hp.JointStops(stiffness=200.0))


@cache
def control() -> hp.KinematicControl:
    """Return a walk."""
    return hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=1.2))


@cache
def case_text() -> str:
    """Return a case as TOML."""
    return hp.Case(scene(), control(), duration=0.01, sample=0.002).to_toml()


@cache
def trace() -> hp.Trace:
    """Return a short trace."""
    return hp.simulate(scene(), control(), duration=0.02)


@cache
def folder() -> Path:
    """Return a folder for files of this process."""
    path = Path(tempfile.mkdtemp(prefix="hexapod-fuzz-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@cache
def trace_bytes() -> bytes:
    """Return a trace's file."""
    return trace().save(folder() / "sound.nc").read_bytes()


@cache
def summary_data() -> Any:
    """Return a summary's data."""
    [summary] = hp.simulate_batch([hp.Case(scene(), control(), duration=0.02)], keep="summary")
    assert isinstance(summary, hp.Summary)
    return json.loads(summary.to_json())


@cache
def urdf_text() -> str:
    """Return a URDF."""
    return hp.urdf_path("kharagpur").read_text(encoding="utf-8")


def used(robot_or_scene: Any) -> None:
    """Run what was accepted for a moment."""
    where = robot_or_scene
    if isinstance(where, hp.Robot):
        where = hp.Scene(where)
    limits = hp.WorkLimits(evaluations=3e4)
    found = hp.simulate(
        where, hp.HoldPosture(), duration=2e-3, sample=1e-3, estimate=False, limits=limits
    )
    if not (abs(found.q) < 1e300).all():
        raise ArithmeticError("a number that is not finite came out of a run")

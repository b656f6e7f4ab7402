"""Sound things that odd inputs are made from; each is made once in a process."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import hexapod_pin as hp
from fuzz.shown import FaultFound
from fuzz.watched_folder import WatchedFolder


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
def watched() -> WatchedFolder:
    """Return the tree that inputs of this process work in."""
    return WatchedFolder(_own_folder() / "tree")


@cache
def _own_folder() -> Path:
    path = Path(tempfile.mkdtemp(prefix="hexapod-fuzz-"))
    atexit.register(_remove, path, os.getpid())
    return path


def _remove(path: Path, owner: int) -> None:
    """Remove the folder of this process; a forked child that ends leaves that of its parent."""
    if os.getpid() == owner:
        shutil.rmtree(path, ignore_errors=True)


@cache
def folder() -> Path:
    """Return a folder for files of this process."""
    path = _own_folder() / "files"
    path.mkdir()
    return path


def new_file(ending: str) -> Path:
    """Return a path without a file, or anything that belongs to one."""
    path = folder() / f"new.{ending}"
    for old in folder().glob(f"{path.name}*"):
        old.unlink()
    return path


def written(ending: str, content: str | bytes) -> Path:
    """Return the path of a new file."""
    path = folder() / f"sound.{ending}"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@cache
def walk() -> hp.Trace:
    """Return a trace of a whole steady cycle."""
    given: dict[str, Any] = {"accuracy": 1e-3, "estimate": False, "sample": 0.02}
    return hp.simulate(scene(), control(), duration=3.9, **given)


@cache
def state() -> hp.State:
    """Return a state that the robot can have."""
    return robot().stand()


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


HINTS_TEXT = """forward = "x"
foot_radius = 0.01
repair = false
mass = 2.0

[posture]
"""
"""Hints about a robot."""


STUDY_TEXT = """schema = 1
name = "friction and payload"
[base]
robot = "kharagpur"
gait = "tripod"
duration = 1.0
accuracy = 1e-4
[[vary]]
input = "stroke"
values = [0.06, 0.1]
[[vary]]
input = "mu"
distribution = "uniform"
low = 0.4
high = 0.9
[design]
kind = "sobol"
samples = 4
seed = 7
"""
"""A study."""

SHORT_STUDY = (
    STUDY_TEXT.replace("1e-4", "1e-3").replace("samples = 4", "samples = 2")
    .replace("[0.06, 0.1]", "[0.08]")
    .replace('"tripod"', '{name = "tripod", cycle_time = 1.2}').replace("1.0", "3.9")
)  # fmt: skip
"""A study of two cases, each of a whole steady cycle."""

MOTORS_TEXT = """schema = 1
[base]
robot = "kharagpur"
gait = {name = "tripod", cycle_time = 1.2, stroke = 0.1}
method = "robust"
step = 2e-3
duration = 3.6
[motors]
voltage = 12.0
models = ["AX-12A", "MX-106"]
"""
"""A study of motors."""


@cache
def store_bytes() -> bytes:
    """Return the store of a sweep."""
    path = folder() / f"{os.getpid()}.sound.db"
    study = hp.study.SweepStudy.from_toml(SHORT_STUDY)
    str(hp.run_sweep(study, path).dataset)  # imports what a store is read with
    return path.read_bytes()


@cache
def catalog_text() -> str:
    """Return a catalogue."""
    from hexapod_pin.drive.catalog.catalog import catalog_text

    return catalog_text(hp.load_catalog().records[:6])


@cache
def xacro_text() -> str:
    """Return a xacro file: a robot's body with properties, a macro and expressions."""
    head = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    own = """<xacro:arg name="size" default="2"/>
<xacro:property name="half" value="${$(arg size) / 4.0}"/>
<xacro:macro name="marker" params="name mass:=0.01 *origin">
  <link name="${name}"><inertial><mass value="${mass * half}"/>
    <inertia ixx="${1e-6 * 2**2}" ixy="0" ixz="0" iyy="4e-6" iyz="0" izz="4e-6"/></inertial></link>
  <joint name="${name}_joint" type="fixed"><xacro:insert_block name="origin"/>
    <parent link="base_link"/><child link="${name}"/></joint>
</xacro:macro>
<xacro:if value="${half > 0}"><xacro:marker name="m${len('abc')}" mass="0.02">
  <origin xyz="0 0 ${sin(pi / 6)}" rpy="0 ${radians(30)} 0"/></xacro:marker></xacro:if>
"""
    body = urdf_text()
    return head + own + body[body.index(">", body.index("<robot")) + 1 :]


def used(robot_or_scene: Any) -> None:
    """Run what was accepted for a moment."""
    where = robot_or_scene
    if isinstance(where, hp.Robot):
        where = hp.Scene(where)
    limits = hp.simulation.WorkLimits(evaluations=3e4)
    found = hp.simulate(
        where, hp.HoldPosture(), duration=2e-3, sample=1e-3, estimate=False, limits=limits
    )
    if not (abs(found.q) < 1e300).all():
        raise FaultFound("a number that is not finite came out of a run")

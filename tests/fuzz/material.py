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

import public_samples
from public_samples import robot, walk

import hexapod_pin as hp
from fuzz.values import FaultFound
from fuzz.watched_folder import WatchedFolder
from hexapod_pin.drive.catalog.catalog import catalog_text as text_of

__all__ = ["robot", "walk"]

SHORT_STUDY = public_samples.STUDY + public_samples.VARIED
"""A study of two cases, each of a whole steady cycle."""

STUDY_TEXT = public_samples.STUDY + public_samples.DRAWN

MOTORS_TEXT = (
    public_samples.STUDY.replace("cycle_time = 0.3", "cycle_time = 1.2").replace("0.9", "3.6")
    + '[motors]\nvoltage = 12.0\nmodels = ["AX-12A", "MX-106"]\n'
)

HINTS_TEXT = """forward = "x"
foot_radius = 0.01
repair = false
mass = 2.0

[posture]
"""
"""Hints about a robot."""


@cache
def scene() -> hp.Scene:
    loads = [hp.Payload("base_link", mass=0.3, position=(0.0, 0.0, 0.05))]
    return hp.Scene(robot(), loads=loads, stops=hp.JointStops(stiffness=200.0))


@cache
def case_text() -> str:
    return hp.Case(scene(), walk(), duration=0.01, sample=0.002).to_toml()


@cache
def trace() -> hp.Trace:
    return hp.simulate(scene(), walk(), duration=0.02)


@cache
def watched() -> WatchedFolder:
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
    path = new_file(ending)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@cache
def trace_bytes() -> bytes:
    return trace().save(new_file("nc")).read_bytes()


@cache
def summary_data() -> Any:
    [summary] = hp.simulate_batch([hp.Case(scene(), walk(), duration=0.02)], keep="summary")
    assert isinstance(summary, hp.Summary)
    return json.loads(summary.to_json())


@cache
def urdf_text() -> str:
    return hp.urdf_path("kharagpur").read_text(encoding="utf-8")


@cache
def store_bytes() -> bytes:
    path = new_file("db")
    str(
        hp.run_sweep(hp.study.SweepStudy.from_toml(SHORT_STUDY), path).dataset
    )  # imports its reader
    return path.read_bytes()


@cache
def catalog_text() -> str:
    return text_of(hp.load_catalog().records[:6])


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


LIMITS = hp.simulation.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8)
"""Of every run, so that it ends soon."""


def used(where: hp.Robot | hp.Scene) -> None:
    given = hp.Scene(where) if isinstance(where, hp.Robot) else where
    found = hp.simulate(
        given, hp.HoldPosture(), duration=2e-3, sample=1e-3, estimate=False, limits=LIMITS
    )
    if not (abs(found.q) < 1e300).all():
        raise FaultFound("a number that is not finite came out of a run")

"""The doors: each draws one input from a seeded generator and pushes it through."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping

from fuzz import call_doors, file_doors
from fuzz.command_door import command_line, study_line
from fuzz.command_process import command_process

Door = Callable[[random.Random], None]

DOORS: Mapping[str, Door] = {
    door.__name__: door
    for door in (
        file_doors.urdf, file_doors.xacro, file_doors.hints, file_doors.scene, file_doors.case,
        file_doors.study, file_doors.catalog, file_doors.damaged_trace, file_doors.forged_trace,
        file_doors.sweep_store, file_doors.checkpoint, file_doors.summary, call_doors.parameters,
        call_doors.settings, call_doors.public_call, call_doors.height_field, call_doors.session,
        call_doors.extremes, command_line, study_line, command_process,
    )
}  # fmt: skip
"""All doors by name."""

WEIGHTS: Mapping[str, int] = {"public_call": 6}
"""How many inputs go to a door for each that goes to another: it stands for hundreds of calls."""

SELDOM = ("command_process",)
"""Doors whose inputs are processes of their own, which take half a second each."""

"""The walks that motors must carry: the grid of a study, each with its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from hexapod_pin.control.walk_schedule import TRANSIENT_CYCLES
from hexapod_pin.simulation.case import Case
from hexapod_pin.sweep.study.base_case import base_case
from hexapod_pin.sweep.study.gait_inputs import gait_of
from hexapod_pin.sweep.study.sweep_study import SweepStudy

STEADY_CYCLES = 1
"""Whole cycles of steady walking that a budget is taken over, at least: they repeat."""


SAMPLE = 2e-3
"""Time between samples where the study gives none [s]: lines are held against samples."""


def required_walks(tables: Mapping[str, Any], folder: Path) -> dict[str, Case]:
    """Return the cases of a study's grid; without a grid, its base.

    Each lasts as long as the study says, or as its start-up and one more cycle where that is
    longer.

    Args:
        tables: of the study file; uncertain inputs are left out.
        folder: where its relative paths start.

    Raises:
        ParameterError: the file is not usable; names the place in it.
        UrdfError, UnknownNameError, GaitError: its robot or gait is not.
    """
    import tomli_w

    base = tables.get("base", {})
    if isinstance(base, Mapping) and "case" not in base:
        tables = {**tables, "base": {"sample": SAMPLE, **base}}
    vary = tables.get("vary", [])
    grid = [x for x in vary if not (isinstance(x, Mapping) and "distribution" in x)]
    if not grid:
        return {"walk": long_enough(base_case(tables.get("base", {}), folder))}
    kept = {key: value for key, value in tables.items() if key != "design"}
    study = SweepStudy(tomli_w.dumps({**kept, "vary": grid}), folder)
    names = [_name(study, k) for k in range(len(study))]
    return {name: long_enough(study.case(k)) for k, name in enumerate(names)}


def long_enough(case: Case) -> Case:
    """Return a case that holds a steady cycle."""
    gait = gait_of(case.controller)
    if gait is None or case.duration is None:
        return case
    least = (TRANSIENT_CYCLES + STEADY_CYCLES) * gait.cycle_time
    return case if case.duration >= least else replace(case, duration=least)


def _name(study: SweepStudy, index: int) -> str:
    """Return what a walk is called: the values of its inputs."""
    parts = []
    for item in study.inputs:
        value = study.point(index)[item.name]
        unit = "" if item.unit in ("", "-") else f" {item.unit}"
        parts.append(value if isinstance(value, str) else f"{item.name} {value:g}{unit}")
    return ", ".join(parts)

"""What the file of a trace must hold: rules of its arrays, its `meta` and its counters."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated, Any, NamedTuple

import numpy.typing as npt

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import (
    ArrayRule,
    NotNegative,
    check_arrays,
    check_data,
    check_names,
    json_object,
    per,
)
from hexapod_pin.results.checkpoint_schema import CheckpointData
from hexapod_pin.results.error_estimate import QUANTITIES
from hexapod_pin.results.recorded_settings import check_settings
from hexapod_pin.results.run_schema import Counters, PerJoint, RunData
from hexapod_pin.results.summary_schema import SummaryData
from hexapod_pin.results.trace_layout import BASE_Q, BASE_V, ENERGIES, LAYOUT

ENERGY, ERROR = "energy_", "error_"
"""How the names of energies and of estimated errors begin."""

DERIVED = "energy_residual"
"""Follows from the others; not read."""

LATEST = 1e10
"""Of a sample's time [s]: three centuries."""

RULES: dict[str, ArrayRule] = {
    name: ArrayRule(axes, unit) for name, (axes, unit, _) in LAYOUT.items()
} | {
    "time": ArrayRule(("time",), "s", least=0.0, most=LATEST, ascending=True),
    "q": ArrayRule(("time", "q_name"), "m, 1, rad", unit_vector=(3, 7)),
    "foot_normal": ArrayRule(("time", "foot", "axis"), "1", unit_vector=(0, 3)),
}
ENERGY_RULE = ArrayRule(("time",), "J")
ERROR_RULE = ArrayRule(("time",), least=0.0, ascending="weakly")


class TraceMeta(RunData):
    """`Trace.meta`."""

    checkpoint: CheckpointData | None = None
    summary: SummaryData | None = None
    urdf: str | None = None
    foot_radius: Annotated[list[NotNegative], per("foot")] | None = None
    velocity_limit: PerJoint | None = None
    versions: dict[str, str] = {}


class TraceParts(NamedTuple):
    """Texts of a file that were checked."""

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    meta: dict[str, Any]
    counters: dict[str, Any]


def checked_trace(
    arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str] = ()
) -> TraceParts:
    """Check all variables of a trace's file and return its texts.

    Args:
        arrays: the variables.
        absent: arrays that the file need not hold.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    joints, feet = (
        check_names("joint", arrays.get("joint")),
        check_names("foot", arrays.get("foot")),
    )
    time = arrays.get("time")
    if time is None or time.ndim != 1 or not len(time):
        raise ParameterError("time", None if time is None else time.shape, "at least one time [s]")
    sizes = {
        "time": len(time), "joint": len(joints), "foot": len(feet), "axis": 3,
        "q_name": len(BASE_Q) + len(joints), "v_name": len(BASE_V) + len(joints),
    }  # fmt: skip
    check_arrays(arrays, _rules(arrays, absent), sizes)
    meta, counters = (json_object(name, arrays.get(name)) for name in ("meta", "counters"))
    check_data(TraceMeta, "meta", meta, joint=len(joints), foot=len(feet))
    check_data(Counters, "counters", counters)
    check_settings(meta)
    return TraceParts(joints, feet, meta, counters)


def _rules(arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str]) -> dict[str, ArrayRule]:
    """Return the rules of the arrays that are there or must be."""
    rules = {name: rule for name, rule in RULES.items() if name not in absent}
    if "energy" not in absent:
        stored = [name for name in arrays if name.startswith(ENERGY) and name != DERIVED]
        rules |= dict.fromkeys([*(ENERGY + name for name in ENERGIES), *stored], ENERGY_RULE)
    errors = [ERROR + name for name in QUANTITIES if ERROR + name in arrays]
    if errors:
        needed = (ERROR + name for name in ("place", "turn", "joint"))
        rules |= dict.fromkeys([*needed, *errors], ERROR_RULE)
    return rules

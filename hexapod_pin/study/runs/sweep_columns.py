"""The columns of a sweep's dataset: cases by joints, feet and kinds, inputs as coordinates."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.joint_budget import KINDS, OTHER_KINDS
from hexapod_pin.results.result_files import Column
from hexapod_pin.results.schema import Quantity
from hexapod_pin.study.runs.outcome import PATH
from hexapod_pin.study.runs.store_reading import StoredSweep, columns, ways

if TYPE_CHECKING:
    from xarray import Dataset

CASE = "case"
TITLE = "hexapod_pin sweep"

COUNTER = "count_"
"""How the columns of the integration's counters begin."""


def sweep_columns(found: StoredSweep) -> dict[str, Column]:
    """Return all variables and coordinates of a sweep's dataset."""
    values = columns(found)
    made = _coordinates(found)
    for name, one in found.quantities.items():
        made[name] = Column((CASE, *one.axes), values[name], one.about)
        made |= _of_kinds(found, name, one, values[name])
    made[PATH] = Column(
        (CASE, "edge", "way_column"), ways(found),
        {"units": "s, m, m, rad", "long_name": "time, x and y of the centre of mass, yaw of the "
         "trunk at edges and middles of the cycles"},
    )  # fmt: skip
    made |= _counters(found)
    made["reason"] = _text(found.reason, "why a case has no numbers; empty where it has")
    made["verdict"] = _text(found.verdict, "why a robot does not walk; empty where it does")
    return made


def sweep_attributes(found: StoredSweep) -> dict[str, str]:
    """Return the attributes of a sweep's dataset."""
    texts = found.texts
    return {
        "title": TITLE,
        "study_name": texts["name"],
        "study": texts["study"],
        "study_digest": texts["digest"],
        "robots": "\n".join(found.robots),
        "assumed": "\n".join(found.assumed),
        "versions": texts["versions"],
        "inputs": json.dumps([item.about for item in found.inputs]),
    }


def to_dataset(
    made: Mapping[str, Column], attributes: Mapping[str, str], varied: Iterable[Mapping[str, Any]]
) -> Dataset:
    """Return columns as an xarray dataset; what is varied and labels are its coordinates."""
    import xarray

    inputs = coordinate_names(varied)
    variables = {
        name: xarray.Variable(column.dims, column.values, dict(column.attributes))
        for name, column in made.items()
    }
    labels = [name for name, column in made.items() if column.dims == (name,)]
    coordinates = {name: variables.pop(name) for name in [*labels, *inputs.values()]}
    return xarray.Dataset(variables, coordinates, dict(attributes))


def coordinate_names(inputs: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return the name of each input's coordinate: its own, or `input_` and its own if taken."""
    from hexapod_pin.study.runs.outcome import quantities

    taken = {*quantities(), PATH, CASE, "joint", "foot", "axis", "kind", "reason", "verdict"}
    names = [item["name"].replace("/", "_") for item in inputs]
    return {name: f"input_{name}" if name in taken else name for name in names}


def _coordinates(found: StoredSweep) -> dict[str, Column]:
    """Return the labels of the axes, and the inputs along the cases."""
    kinds = _kinds(found)
    numbers = np.arange(found.count)
    made = {
        CASE: Column((CASE,), numbers, {"long_name": "index of the case in its study"}),
        "joint": _labels("joint", found.place("joints")),
        "foot": _labels("foot", found.place("feet")),
        "axis": _labels("axis", ["x", "y", "z"]),
        "kind": _labels("kind", kinds),
    }
    names = coordinate_names([item.about for item in found.inputs])
    for about, values in found.inputs:
        text = {"units": about["unit"], "long_name": f"{about['meaning']}: {about['values']}"}
        made[names[about["name"].replace("/", "_")]] = Column((CASE,), values, text)
    return made


def _labels(axis: str, names: Iterable[str]) -> Column:
    return Column(
        (axis,), np.array(list(names), dtype=object), {"long_name": f"name of the {axis}"}
    )


def _text(words: Iterable[str], meaning: str) -> Column:
    return Column((CASE,), np.array(list(words), dtype=object), {"long_name": meaning})


def _kinds(found: StoredSweep) -> list[str]:
    """Return the kinds of joints that there are, in their usual order."""
    there = set(found.kinds.values())
    return [kind for kind in (*KINDS, *OTHER_KINDS) if kind in there]


def _of_kinds(found: StoredSweep, name: str, one: Quantity, values: Array) -> dict[str, Column]:
    """Return what the joints of each kind come to: the largest size, the sum of energies."""
    if not has_kinds(one):
        return {}
    kinds, own, summed = _kinds(found), found.kinds, one.by_kind == "sum"
    of_joint = np.array([kinds.index(own[joint]) for joint in found.place("joints")], dtype=int)
    filled = np.full((found.count, len(kinds)), np.nan)
    for k in range(len(kinds)):
        part = values[:, of_joint == k]
        known = ~np.isnan(part).all(axis=1)
        size = np.abs(part[known])
        filled[known, k] = np.nansum(part[known], 1) if summed else np.nanmax(size, 1)
    how = "sum over" if summed else "largest size among"
    about = {"units": one.unit, "long_name": f"{one.meaning}: {how} the joints of a kind"}
    return {f"kind_{name}": Column((CASE, "kind"), filled, about)}


def has_kinds(one: Quantity) -> bool:
    """Whether a quantity of each joint has a column of each kind of joint, too."""
    return one.axes == ("joint",) and bool(one.by_kind)


def _counters(found: StoredSweep) -> dict[str, Column]:
    """Return the counters of the integration."""
    names = dict.fromkeys(name for one in found.counters.values() for name in one)
    made = {}
    for name in sorted(names):
        values = np.full(found.count, np.nan)
        for number, one in found.counters.items():
            values[number] = one.get(name, np.nan)
        about = {"units": "1", "long_name": f"counter of the integration: {name}"}
        made[COUNTER + name] = Column((CASE,), values, about)
    return made

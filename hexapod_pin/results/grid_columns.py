"""Arrays over the grid of a sweep: checked, made read-only, written as labelled columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.results.accuracy_check import AccuracyCheck
from hexapod_pin.results.netcdf import Column, Group
from hexapod_pin.results.trace_layout import described, frozen_json

Layout = Mapping[str, tuple[tuple[str, ...], str, str]]
"""Name: (axes, unit, meaning) of every array."""


def empty_grid(layout: Layout, sizes: Mapping[str, int]) -> dict[str, Array]:
    """Return an array of NaN for each name of a layout."""
    return {
        name: np.full(tuple(sizes[axis] for axis in axes), np.nan)
        for name, (axes, _, _) in layout.items()
    }


def freeze_grid(
    owner: Any, layout: Layout, sizes: Mapping[str, int], grid: tuple[str, ...]
) -> None:
    """Check the arrays, reasons and `meta` of a frozen dataclass, and make them read-only.

    Args:
        owner: has a field for each name of the layout, `reason` and `meta`.
        layout: of its arrays.
        sizes: of all axes.
        grid: axes of the grid itself, that of `reason`.

    Raises:
        ParameterError: an array has another shape.
    """
    for name, (axes, _, _) in layout.items():
        array = read_only(getattr(owner, name))
        _require_shape(owner, name, array.shape, tuple(sizes[axis] for axis in axes))
        object.__setattr__(owner, name, array)
    reason = np.array(owner.reason, dtype=object)
    _require_shape(owner, "reason", reason.shape, tuple(sizes[axis] for axis in grid))
    reason.flags.writeable = False
    object.__setattr__(owner, "reason", reason)
    object.__setattr__(owner, "meta", frozen_json("meta", owner.meta))


def _require_shape(owner: Any, name: str, shape: tuple[int, ...], wanted: tuple[int, ...]) -> None:
    if shape != wanted:
        raise ParameterError(f"{type(owner).__name__}.{name}", shape, f"of shape {wanted}")


def grid_group(
    owner: Any,
    layout: Layout,
    axes: Mapping[str, Column],
    grid: tuple[str, ...],
    schema: tuple[str, int],
) -> Group:
    """Return a sweep as columns and attributes of a file.

    Args:
        owner: as of `freeze_grid`, with a `check`.
        layout: of its arrays.
        axes: the columns of its axes.
        grid: axes of the grid itself.
        schema: name and version.
    """
    columns = dict(axes)
    for name, (dims, units, meaning) in layout.items():
        columns[name] = Column(dims, getattr(owner, name), described(units, meaning))
    reason = {"long_name": "why the point could not be walked; empty where it was"}
    columns["reason"] = Column(grid, np.array(owner.reason, dtype=object), reason)
    meta = np.array(json.dumps(dict(owner.meta)), dtype=object)
    about = {"long_name": "JSON: scene and controller as TOML text, settings, versions, assumed"}
    columns["meta"] = Column((), meta, about)
    if owner.check is not None:
        columns |= owner.check.columns()
    return Group(columns, {"schema": schema[0], "schema_version": schema[1]})


def grid_fields(arrays: Mapping[str, npt.NDArray[Any]], layout: Layout) -> dict[str, Any]:
    """Return the fields of a sweep that `grid_group` wrote.

    Raises:
        KeyError: a variable is missing.
    """
    return {
        **{name: arrays[name] for name in layout},
        "reason": arrays["reason"],
        "meta": json.loads(arrays["meta"].item()),
        "check": AccuracyCheck.from_columns(arrays),
    }


def same_group(first: Group, second: Group) -> bool:
    """Tell whether two groups hold the same bits, NaN included."""
    if first.attributes != second.attributes or first.columns.keys() != second.columns.keys():
        return False
    return all(_same(a.values, second.columns[name].values) for name, a in first.columns.items())


def _same(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> bool:
    if first.shape != second.shape or first.dtype != second.dtype:
        return False
    if first.dtype == object:
        return bool((first == second).all())
    return first.tobytes() == second.tobytes()


def require_schema(where: str, attributes: Mapping[str, Any], schema: tuple[str, int]) -> None:
    """Refuse a group of another kind, or of a later release.

    Raises:
        TraceFileError: says which.
    """
    if attributes.get("schema") != schema[0]:
        found = attributes.get("schema")
        raise TraceFileError(f"{where}: schema {found!r} instead of {schema[0]!r}.")
    version = attributes.get("schema_version")
    if not isinstance(version, int | np.integer) or not 1 <= version <= schema[1]:
        raise TraceFileError(
            f"{where}: schema version {version}; this release reads versions up to {schema[1]}."
        )

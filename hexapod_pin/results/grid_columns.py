"""Results over a grid of walks are written as labelled columns.

Some walks are repeated at a tighter accuracy, which gives a stated error.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.file_schema import (
    ArrayRule,
    Name,
    NotNegative,
    Number,
    check_arrays,
    check_data,
    check_names,
    json_object,
)
from hexapod_pin.results.result_files import Column, Group
from hexapod_pin.results.run_record import Facts
from hexapod_pin.results.trace_layout import described


class GridRecord(Facts):
    """How the walks of a grid came about.

    Attributes:
        robot: its name.
        walk: the name of the walk.
        scene: that of all walks, as TOML text.
        scenes: those of gaits, by the number of legs, as TOML text.
        controller: that of the first walk, or the gaits, as TOML text.
        rule: what gaits have in common: "equal stroke" or "equal cycle time".
        rule_value: its value [m or s].
        accuracy: of the runs [m and rad].
        cycles: in the window of each walk.
        assumed: statements of every number that no source gives.
        versions: of the packages that the numbers depend on.
    """

    robot: Name = "robot"
    walk: str = "walk"
    scene: str = ""
    scenes: dict[str, str] = {}
    controller: str = ""
    rule: str = ""
    rule_value: Number | None = None
    accuracy: NotNegative | None = None
    cycles: Annotated[int, Field(ge=0)] | None = None
    assumed: Annotated[tuple[str, ...], Field(strict=False)] = ()
    versions: dict[str, str] = {}


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
    """Check the arrays and reasons of a frozen dataclass, and make them read-only.

    Args:
        owner: has a field for each name of the layout, and `reason`.
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
    run = np.array(
        json.dumps(owner.run.model_dump(mode="json", exclude_defaults=True)), dtype=object
    )
    about = {"long_name": "JSON: scene and controller as TOML text, settings, versions, assumed"}
    columns["run"] = Column((), run, about)
    if owner.check is not None:
        columns |= owner.check.columns()
    return Group(columns, {"schema": schema[0], "schema_version": schema[1]})


def check_grid(
    arrays: Mapping[str, npt.NDArray[Any]],
    layout: Layout,
    grid: tuple[str, ...],
    names: tuple[str, ...],
    rules: Mapping[str, ArrayRule],
) -> None:
    """Check the variables of a sweep that `grid_group` wrote.

    Args:
        arrays: the variables.
        layout: of the sweep's arrays; NaN where a point could not be walked.
        grid: axes of the grid itself.
        names: axes that have names.
        rules: of the numbers along the axes.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    sizes = {name: len(check_names(name, arrays.get(name))) for name in names}
    for name, rule in rules.items():
        sizes |= {axis: np.size(arrays.get(name, ())) for axis in rule.axes if axis not in sizes}
    cells = {name: ArrayRule(axes, unit, nan=True) for name, (axes, unit, _) in layout.items()}
    check_arrays(arrays, {**rules, **cells}, sizes)
    _check_reasons(arrays.get("reason"), tuple(sizes[axis] for axis in grid))
    check_data(GridRecord, "run", json_object("run", arrays.get("run")))
    if "check_change" in arrays:
        _check_repeated(arrays, tuple(sizes[axis] for axis in grid))


def _check_reasons(reason: npt.NDArray[Any] | None, shape: tuple[int, ...]) -> None:
    if reason is None or reason.dtype.kind != "O" or reason.shape != shape:
        found = None if reason is None else f"{reason.dtype} of shape {reason.shape}"
        raise ParameterError("reason", found, f"texts of shape {shape}")


def _check_repeated(arrays: Mapping[str, npt.NDArray[Any]], shape: tuple[int, ...]) -> None:
    """Check the points that were run again at a tighter accuracy."""
    count = len(check_names("check_quantity", arrays.get("check_quantity")))
    points = arrays.get("check_point")
    if points is None or points.dtype.kind != "i" or points.ndim != 2:
        raise ParameterError("check_point", None if points is None else points.shape, "indices")
    if points.shape[1] != len(shape) or (points < 0).any() or (points >= shape).any():
        raise ParameterError("check_point", points.shape, f"places on a grid of {shape}")
    rules = {
        "check_accuracy": ArrayRule((), least=0.0),
        "check_change": ArrayRule(("check", "check_quantity"), least=0.0, nan=True),
    }
    check_arrays(arrays, rules, {"check": len(points), "check_quantity": count})


def grid_fields(arrays: Mapping[str, npt.NDArray[Any]], layout: Layout) -> dict[str, Any]:
    """Return the fields of a sweep that `grid_group` wrote.

    Raises:
        KeyError: a variable is missing.
    """
    return {
        **{name: arrays[name] for name in layout},
        "reason": arrays["reason"],
        "run": check_data(GridRecord, "run", json_object("run", arrays["run"])),
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
    found = attributes.get("schema")
    if not isinstance(found, str) or found != schema[0]:
        raise TraceFileError(f"{where}: schema {found!r} instead of {schema[0]!r}.")
    version = attributes.get("schema_version")
    if not isinstance(version, int | np.integer) or not 1 <= version <= schema[1]:
        raise TraceFileError(
            f"{where}: schema version {version}; this release reads versions up to {schema[1]}."
        )


# How much the numbers of a sweep change at a tighter accuracy: its stated error.


@dataclass(frozen=True, eq=False)
class AccuracyCheck:
    """Some points of a sweep, run again at a tighter accuracy.

    Attributes:
        accuracy: that the repeated runs were asked for [m and rad].
        points: their places on the grid, K points with an index per axis. Shape (K, D).
        quantities: Q names.
        change: largest change of each quantity over joints or feet, over its largest value there
            [-]. Shape (K, Q).
    """

    accuracy: float
    points: npt.NDArray[np.int64]
    quantities: tuple[str, ...]
    change: Array

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        points = np.array(self.points, dtype=np.int64)
        points.flags.writeable = False
        change = read_only(self.change)
        if points.ndim != 2 or change.shape != (len(points), len(self.quantities)):
            raise ParameterError("AccuracyCheck.change", change.shape, "points by quantities")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "change", change)
        object.__setattr__(self, "quantities", tuple(self.quantities))

    def error(self, quantity: str, first: int | None = None) -> float:
        """Return the largest relative change of a quantity at the repeated points [-].

        Args:
            quantity: one of `quantities`.
            first: of the points with this index on the grid's first axis alone; NaN where there is
                none. None: of all.

        Raises:
            UnknownNameError: that quantity was not compared.
        """
        if quantity not in self.quantities:
            raise UnknownNameError("quantity", quantity, list(self.quantities))
        change = self.change[:, self.quantities.index(quantity)]
        if first is not None:
            change = change[self.points[:, 0] == first]
        known = change[np.isfinite(change)]
        return float(known.max()) if len(known) else float("nan")

    def columns(self) -> dict[str, Column]:
        """Return the check as columns of a file; names begin with "check_"."""
        names = np.array(self.quantities, dtype=object)
        about = described("1", "largest relative change at check_accuracy")
        accuracy = described("m and rad", "accuracy of the repeated runs")
        places = described("1", "place of a repeated point: an index per axis of the grid")
        return {
            "check_quantity": Column(("check_quantity",), names, {}),
            "check_accuracy": Column((), np.array(self.accuracy), accuracy),
            "check_point": Column(("check", "grid_axis"), self.points, places),
            "check_change": Column(("check", "check_quantity"), self.change, about),
        }

    @classmethod
    def from_columns(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> AccuracyCheck | None:
        """Return the check among the variables of a file; None where there is none."""
        if "check_change" not in arrays:
            return None
        return cls(
            float(arrays["check_accuracy"]), arrays["check_point"],
            tuple(arrays["check_quantity"]), arrays["check_change"],
        )  # fmt: skip


def relative_change(value: Any, other: Any) -> float:
    """Return the largest difference of two numbers or arrays over the largest size of the other."""
    size = float(np.max(np.abs(other)))
    difference = float(np.max(np.abs(np.asarray(value) - np.asarray(other))))
    return difference / size if size > 0.0 else difference

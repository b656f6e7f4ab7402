"""Results over a grid of walks are written as labelled columns.

Some walks are repeated at a tighter accuracy, which gives a stated error.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from hexapod_pin.arrays import Array, read_only, same_bits
from hexapod_pin.errors import ParameterError, TraceFileError
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
from hexapod_pin.results.result_files import Column, Group, described, require_schema, write_netcdf
from hexapod_pin.results.run_record import Facts
from hexapod_pin.results.schema import Record, require_known, schema

if TYPE_CHECKING:
    from typing_extensions import Self


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


# How much the numbers of a sweep change at a tighter accuracy: its stated error.


@dataclass(frozen=True, eq=False)
class AccuracyCheck:
    """Some points of a sweep, run again at a tighter accuracy.

    Attributes:
        accuracy: requested of the repeated runs [m and rad].
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

    def __eq__(self, other: object) -> bool:
        """Tell whether every number is the same."""
        return isinstance(other, AccuracyCheck) and same_bits(vars(self), vars(other))

    __hash__ = None  # type: ignore[assignment]  # equal by content

    def error(self, quantity: str, first: int | None = None) -> float:
        """Return the largest relative change of a quantity at the repeated points [-].

        Args:
            quantity: one of `quantities`.
            first: of the points with this index on the grid's first axis alone; NaN where there is
                none. None: of all.

        Raises:
            UnknownNameError: that quantity was not compared.
        """
        require_known("quantity", quantity, self.quantities)
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


class GridResult(Record):
    """Base of results over a grid of walks: a number per point, NaN where it could not be walked.

    Attributes:
        reason: why a point could not be walked, "" where it was; of the shape of the grid.
        check: some points at a tighter accuracy; None where none was run.
        run: how the walks came about: scenes, controllers, settings, what is assumed.
    """

    GRID: ClassVar[tuple[str, ...]] = ()
    """The axes of the grid."""

    FILE: ClassVar[tuple[str, int]] = ("", 0)
    """Schema of the file, and its version."""

    TEXTS: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Fields of one text per label, by the column that holds them: axis and field."""

    reason: npt.NDArray[np.object_] = field(kw_only=True)
    check: AccuracyCheck | None = field(default=None, kw_only=True)
    run: GridRecord = field(default=GridRecord(), kw_only=True)

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        super().__post_init__()
        sizes = self.sizes()
        for axis, name in self.TEXTS.values():
            object.__setattr__(self, name, tuple(getattr(self, name)))
            if len(getattr(self, name)) != sizes[axis]:
                where = f"{type(self).__name__}.{name}"
                raise ParameterError(where, getattr(self, name), f"one per {axis}")
        reason = np.array(self.reason, dtype=object)
        shape = tuple(sizes[axis] for axis in self.GRID)
        if reason.shape != shape:
            raise ParameterError(f"{type(self).__name__}.reason", reason.shape, f"of shape {shape}")
        reason.flags.writeable = False
        object.__setattr__(self, "reason", reason)

    @classmethod
    def empty(cls, sizes: Mapping[str, int]) -> dict[str, Array]:
        """Return an array of NaN for each quantity of the points; `sizes`: of all axes.

        Raises:
            ParameterError: the size of an axis is missing.
        """
        points = {k: one for k, one in schema(cls).items() if one.axes[: len(cls.GRID)] == cls.GRID}
        missing = {axis for one in points.values() for axis in one.axes} - sizes.keys()
        if missing:
            raise ParameterError("sizes", sorted(sizes), f"with {', '.join(sorted(missing))}")
        return {
            name: np.full(tuple(sizes[axis] for axis in one.axes), np.nan)
            for name, one in points.items()
        }

    @property
    def finished(self) -> bool:
        """Whether every point was run or refused."""
        return not any(reason == NOT_RUN for reason in self.reason.flat)

    def columns(self) -> dict[str, Column]:
        """Return everything as columns of a file."""
        columns = super().columns()
        for name, (axis, texts) in self.TEXTS.items():
            columns[name] = Column((axis,), np.array(getattr(self, texts), dtype=object), {})
        reason = {"long_name": "why the point could not be walked; empty where it was"}
        columns["reason"] = Column(self.GRID, np.array(self.reason, dtype=object), reason)
        run = json.dumps(self.run.model_dump(mode="json", exclude_defaults=True))
        about = {"long_name": "JSON: scene and controller as TOML text, settings, versions"}
        columns["run"] = Column((), np.array(run, dtype=object), about)
        return columns | ({} if self.check is None else self.check.columns())

    def group(self) -> Group:
        """Return everything as columns and attributes of a file."""
        return Group(self.columns(), {"schema": self.FILE[0], "schema_version": self.FILE[1]})

    @classmethod
    def from_group(
        cls, where: str, group: tuple[Mapping[str, npt.NDArray[Any]], Mapping[str, Any]]
    ) -> Self:
        """Return what a group's arrays and attributes hold; `where` is for messages.

        Raises:
            TraceFileError: the group is damaged, of another kind or of another schema.
        """
        arrays, attributes = group
        require_schema(where, attributes, cls.FILE)
        try:
            return cls(**_checked_fields(cls, arrays))
        except ParameterError as error:
            raise TraceFileError(f"{where}: {error}") from error

    def save(self, path: str | Path) -> Path:
        """Write a netCDF-4 file, wholly or not at all, and return its path.

        Raises:
            TraceFileError: the file cannot be written; an old one stays as it was.
        """
        return write_netcdf(path, *self.group())


NOT_RUN = "not run"
"""Reason of a point that an interruption left out."""


def _checked_fields(
    kind: type[GridResult], arrays: Mapping[str, npt.NDArray[Any]]
) -> dict[str, Any]:
    """Return the fields of a grid's result from the variables of its file.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    known, found, sizes = schema(kind), dict[str, Any](), dict[str, int]()
    for axis, labels in kind.AXES.items():
        if axis not in known:
            names = check_names(axis, arrays.get(axis))
            sizes[axis] = len(names)
            found |= {labels: names} if isinstance(labels, str) else {}
    for name, (_, texts) in kind.TEXTS.items():
        found[texts] = check_names(name, arrays.get(name), repeated=True)
    for name, one in known.items():  # lengths of axes without names, from the first array that has
        for axis, size in zip(one.axes, np.shape(arrays.get(name, ())), strict=False):
            sizes.setdefault(axis, size)
    sizes |= {axis: sizes.get(axis, 0) for one in known.values() for axis in one.axes}
    check_arrays(arrays, known, sizes)
    shape = tuple(sizes[axis] for axis in kind.GRID)
    _check_reasons(arrays.get("reason"), shape)
    if "check_change" in arrays:
        _check_repeated(arrays, shape)
    return {
        **found,
        **{name: arrays[name] if one.axes else float(arrays[name]) for name, one in known.items()},
        "reason": arrays["reason"],
        "run": check_data(GridRecord, "run", json_object("run", arrays.get("run"))),
        "check": AccuracyCheck.from_columns(arrays),
    }


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


def relative_change(value: Any, other: Any) -> float:
    """Return the largest difference of two numbers or arrays over the largest size of the other."""
    size = float(np.max(np.abs(other)))
    difference = float(np.max(np.abs(np.asarray(value) - np.asarray(other))))
    return difference / size if size > 0.0 else difference

"""A checkpoint is the state of a run that its future depends on, a controller's memory included."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, StateError
from hexapod_pin.file_schema import FileData, NotNegative, Number, check_data, unit_quaternion
from hexapod_pin.immutable import Immutable

ARRAYS = {"q": 1, "v": 1, "contacts": 2, "command": 2, "impulse": 2}
"""The arrays, and how many axes each has."""


LATEST = 1e12
"""Latest time of a run [s]."""


def _none() -> Array:
    return np.zeros((0, 0))


@checked
@dataclass(frozen=True, eq=False)
class Checkpoint(Immutable):
    """Where a run stands. Two are equal when every number is.

    Attributes:
        time: [s].
        q: configuration, Pinocchio order (base m and quaternion xyzw, joints rad). Shape (nq,).
        v: velocity (base twist in body axes m/s and rad/s, joints rad/s). Shape (nv,).
        contacts: per contact: touch speed [m/s], stretch of the bristle, world axes [m] (3),
            touching, sliding (0 or 1), normal of the face it stands on [-] (3), 0: not known, the
            gap to it [m], and the indices of the patch it stands on and of the one it has come
            from: -1 beside all patches, -2 none, -3 not known. Shape (C, 12); (C, 6), without the
            faces and patches, is taken too.
        controller: what an adaptive method's next step depends on; empty where there is none.
        command: the command that acts: its time and arrival [s], and 1 if it is a cubic, 0 if not;
            angles from and to [rad], rates at both ends [rad/s], torque [N m], a row each; empty
            where set-points are planned.
        impulse: of each contact since the last sample, world axes [N s]. Shape (C, 3).
        loop: the state of the control loop: ticks, measurements under way, the controller's
            state; None where nothing is controlled.
    """

    time: float
    q: Array
    v: Array
    contacts: Array
    controller: tuple[float, ...] = ()
    command: Array = field(default_factory=_none)
    impulse: Array = field(default_factory=_none)
    loop: Any = None

    __hash__: ClassVar[None]  # type: ignore[assignment]  # equal by content

    def __eq__(self, other: object) -> bool:
        """Tell whether both are the same, number by number."""
        return isinstance(other, Checkpoint) and self.to_dict() == other.to_dict()

    def __post_init__(self) -> None:
        """Keep read-only copies.

        Raises:
            ParameterError: the time is negative or later than any run, or `loop` is no mapping.
            StateError: a number is not finite, or an array has another number of axes.
        """
        if not 0.0 <= self.time <= LATEST:
            raise ParameterError("Checkpoint.time", self.time, f"from 0 to {LATEST:g} s")
        object.__setattr__(self, "time", float(self.time))
        object.__setattr__(self, "controller", tuple(map(float, self.controller)))
        if not isinstance(self.loop, Mapping | None):
            kind = type(self.loop).__name__
            raise ParameterError("Checkpoint.loop", kind, "a mapping or None")
        for name, axes in ARRAYS.items():
            array = read_only(getattr(self, name))
            if not np.isfinite(array).all():
                raise StateError(f"Checkpoint.{name} is not finite.")
            if array.ndim != axes:
                raise StateError(
                    f"Checkpoint.{name} has shape {array.shape}: must have {axes} axes."
                )
            object.__setattr__(self, name, array)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON-able form; every digit is written."""
        plain: dict[str, Any] = {"time": self.time, "controller": list(self.controller)}
        plain |= {name: getattr(self, name).tolist() for name in ("q", "v", "contacts")}
        for name in ("command", "impulse"):
            if getattr(self, name).size:
                plain[name] = to_plain(getattr(self, name))
        return plain if self.loop is None else plain | {"loop": to_plain(self.loop)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Checkpoint:
        """Rebuild a checkpoint from its dictionary.

        Raises:
            ParameterError, StateError: it is none of `to_dict`; names the entry.
        """
        check_data(CheckpointData, "checkpoint", data)
        contacts = _memories(data["contacts"])
        more = {
            name: from_plain(data[name], f"checkpoint.{name}")
            for name in ("command", "impulse", "loop")
            if name in data
        }
        for name, columns in (("command", None), ("impulse", 3)):
            _require_table(f"checkpoint.{name}", more.get(name), columns)
        return cls(data["time"], data["q"], data["v"], contacts, tuple(data["controller"]), **more)


def _memories(rows: list[list[float]]) -> Array:
    """Return what contacts remember as an array.

    Raises:
        StateError: the rows are not of one length.
    """
    if len({len(row) for row in rows}) > 1:
        raise StateError("checkpoint.contacts: its rows must be of one length.")
    return np.array(rows, dtype=float).reshape(len(rows), len(rows[0]) if rows else 0)


def _require_table(name: str, values: Any, columns: int | None) -> None:
    """Refuse what is no table of numbers with so many columns, None: any."""
    if values is None:
        return
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu" or values.ndim != 2:
        raise StateError(f"{name}: must be a table of numbers.")
    if columns is not None and values.shape[1] != columns:
        raise StateError(f"{name}: has {values.shape[1]} columns; must have {columns}.")


# What a controller remembers, as JSON can hold it: numbers, arrays, mappings, sequences.

ARRAY, TUPLE = "__array__", "__tuple__"

KINDS = tuple(np.dtype(kind).str for kind in ("f8", "f4", "f2", "i8", "i4", "i2", "i1", "u8", "u4",
                                              "u2", "u1", "?"))  # fmt: skip
"""Types of numbers that an array may have."""


def to_plain(value: Any, where: str = "state") -> Any:
    """Return `value` as JSON-able data; every digit is written.

    Raises:
        StateError: it holds something else; names where.
    """
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise StateError(f"{where}: an array of {array.dtype} cannot be in a checkpoint.")
        return {ARRAY: array.dtype.str, "shape": list(array.shape), "data": array.ravel().tolist()}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple):
        items = [to_plain(item, f"{where}[{k}]") for k, item in enumerate(value)]
        return items if isinstance(value, list) else {TUPLE: items}
    raise StateError(
        f"{where}: {type(value).__name__} cannot be in a checkpoint; a controller's state is "
        "made of numbers, arrays, mappings, lists and tuples."
    )


def odd_part(value: Any, where: str = "state") -> tuple[str, str] | None:
    """Return the place and the type of what `to_plain` would refuse; None where it takes all."""
    if value is None or isinstance(value, str | bool | int | float):
        return None
    if isinstance(value, np.ndarray | np.generic):
        return None if value.dtype.kind in "fiub" else (where, f"array of {value.dtype}")
    if isinstance(value, Mapping):
        parts: Iterable[tuple[str, Any]] = ((f"{where}.{key}", x) for key, x in value.items())
    elif isinstance(value, list | tuple):
        parts = ((f"{where}[{k}]", item) for k, item in enumerate(value))
    else:
        return where, type(value).__name__
    return next((odd for place, item in parts if (odd := odd_part(item, place))), None)


def from_plain(value: Any, where: str = "state") -> Any:
    """Return what `to_plain` was given.

    Raises:
        StateError: `to_plain` has not made it; names where.
    """
    if isinstance(value, list):
        return [from_plain(item, f"{where}[{k}]") for k, item in enumerate(value)]
    if not isinstance(value, Mapping):
        return value
    if ARRAY in value:
        return _array(value, where)
    if TUPLE in value:
        if not isinstance(value[TUPLE], list):
            raise StateError(f"{where}: {TUPLE} must be a list.")
        return tuple(from_plain(item, f"{where}[{k}]") for k, item in enumerate(value[TUPLE]))
    return {key: from_plain(item, f"{where}.{key}") for key, item in value.items()}


def _array(value: Mapping[str, Any], where: str) -> np.ndarray[Any, Any]:
    kind, shape, data = value[ARRAY], value.get("shape"), value.get("data")
    if not isinstance(kind, str) or kind not in KINDS:
        raise StateError(f"{where}: {ARRAY} = {kind!r}: must be one of {', '.join(KINDS)}.")
    if not isinstance(shape, list) or not all(type(n) is int and n >= 0 for n in shape):
        raise StateError(f"{where}.shape = {shape!r}: must be whole numbers.")
    if not isinstance(data, list) or math.prod(shape) != len(data):
        raise StateError(f"{where}: must have as much data as its shape requires.")
    if not all(isinstance(item, int | float) for item in data):
        raise StateError(f"{where}.data: must be numbers.")
    try:
        return np.array(data, dtype=np.dtype(kind)).reshape(shape)
    except (OverflowError, ValueError) as error:
        raise StateError(f"{where}.data: must be numbers of {kind} ({error}).") from error


# What the dictionary of a checkpoint must be.

BASE = 7
"""Coordinates of the base: place and quaternion."""


def _configuration(values: list[float], info: ValidationInfo) -> list[float]:
    joints = (info.context or {}).get("joint")
    if len(values) < BASE or joints is not None and len(values) != BASE + joints:
        raise ValueError(f"{BASE} numbers of the base and one per joint")
    if not unit_quaternion(values[3:BASE]):
        raise ValueError("with a quaternion [3:7] of length 1")
    return values


def _memory(values: list[float]) -> list[float]:
    if len(values) not in (6, 12):
        raise ValueError("12 numbers, or 6 without the face and patch that it stands on")
    return values


class CheckpointData(FileData):
    """`Checkpoint.to_dict()`."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    time: Annotated[NotNegative, Field(le=LATEST)]
    q: Annotated[list[Number], AfterValidator(_configuration)]
    v: list[Number]
    contacts: list[Annotated[list[Number], AfterValidator(_memory)]]
    controller: list[Number]
    command: Any = None
    impulse: Any = None
    loop: Any = None

    @model_validator(mode="after")
    def _as_many_rates(self) -> CheckpointData:
        if len(self.v) != len(self.q) - 1:
            raise ValueError(f"with {len(self.q) - 1} velocities for {len(self.q)} coordinates")
        return self

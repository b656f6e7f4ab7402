"""What a trace holds: its arrays with axes and units, and how they are checked and stored."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError

SCHEMA = "hexapod_pin.trace"
SCHEMA_VERSION = 1
STATE_ENERGIES = ("kinetic", "potential", "elastic")
LOSSES = ("joint_damping_loss", "normal_loss", "friction_loss")
ENERGIES = (*STATE_ENERGIES, "servo_work", *LOSSES)

BASE_Q = ("base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw")
BASE_V = ("base_vx", "base_vy", "base_vz", "base_wx", "base_wy", "base_wz")


def digest_of(
    arrays: Mapping[str, Any],
    joint_names: tuple[str, ...],
    foot_names: tuple[str, ...],
    texts: Mapping[str, Any],
) -> str:
    """Return the SHA-256 over every bit of arrays, names and texts but the wall-clock time.

    Args:
        arrays: by their names in a file.
        joint_names: of the axis "joint".
        foot_names: of the axis "foot".
        texts: what is stored as JSON or TOML text, by its name in a file.
    """
    total = hashlib.sha256()
    for name, values in arrays.items():
        total.update(f"{name}{values.shape}".encode())
        total.update(values.astype("<f8").tobytes())
    run = {key: value for key, value in texts["run"].items() if key != "wall_time"}
    rest = [joint_names, foot_names, {**texts, "run": run}]
    total.update(json.dumps(rest, sort_keys=True).encode())
    return total.hexdigest()


def described(units: str, meaning: str) -> dict[str, str]:
    """Return the attributes of a column."""
    return {"units": units, "long_name": meaning}


def frozen(name: str, values: Any, shape: tuple[int, ...]) -> Array:
    """Return `values` read-only, refusing another shape than `shape`."""
    array = read_only(values)
    if array.shape != shape:
        raise ParameterError(name, array.shape, f"an array of shape {shape}")
    return array


def frozen_json(name: str, values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return `values` as JSON would give them back, so that a file loses nothing."""
    try:
        plain = {key: _json_copy(value) for key, value in _json_keys(values).items()}
    except TypeError as error:
        raise ParameterError(name, error.args[0], "made of what JSON can hold") from error
    return MappingProxyType(plain)


def _json_copy(value: Any) -> Any:
    """Return a value as JSON text would give it back; long texts are shared, not written out."""
    if value is None or type(value) in (str, bool, int, float):
        return value
    if isinstance(value, dict):
        return {key: _json_copy(item) for key, item in _json_keys(value).items()}
    if isinstance(value, list | tuple):
        return [_json_copy(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return _json_copy(value.tolist())
    if isinstance(value, str):  # of a derived class: JSON knows the text alone
        return str.__str__(value)
    if isinstance(value, int | float):
        return int(value) if isinstance(value, int) else float(value)
    raise TypeError(f"{type(value).__name__} {value!r}")


def _json_keys(values: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a mapping whose keys are texts, as JSON makes them."""
    return {_json_key(key): value for key, value in values.items()}


def _json_key(key: Any) -> str:
    """Return a key as JSON makes it: 1 is "1", None is "null"."""
    if isinstance(key, str):
        return key
    if key is None or isinstance(key, bool | int | float):
        return json.dumps(key)
    raise TypeError(f"a key of type {type(key).__name__}, {key!r}")

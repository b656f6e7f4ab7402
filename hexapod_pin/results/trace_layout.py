"""What a trace holds: its arrays with axes and units, and how they are checked and stored."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

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

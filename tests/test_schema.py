"""Records: what is derived from the one line that declares a number."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.schema import (
    Record,
    from_plain,
    known_quantity,
    pack,
    plain,
    quantity,
    unpack,
)


class Loads(Record):
    """Loads of joints.

    Attributes:
        joint_names: n names.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "joint": "joint_names", "axis": ("x", "y")
    }  # fmt: skip

    joint_names: tuple[str, ...]
    mass: float = quantity("", "kg", "mass", least=0.0)
    path: Array = quantity("edge axis", "m", "places", error=False, nan=False)
    force: Array = quantity("joint axis", "N", "force on a joint")
    use: Array = quantity("joint", "1", "fraction of the limit", least=0.0, most=1.0)


SIZES = {"joint": 2, "axis": 2}


def loads(**changes: Any) -> Loads:
    values: dict[str, Any] = {
        "joint_names": ["a", "b"], "mass": 2.5, "path": np.arange(6.0).reshape(3, 2),
        "force": np.array([[1.0, -2.0], [3.0, np.nan]]), "use": [0.25, 0.5],
    }  # fmt: skip
    return Loads(**{**values, **changes})


def test_a_record_is_frozen_and_equal_by_its_bits() -> None:
    record = loads()
    assert record == loads() and record != loads(mass=np.nextafter(2.5, 3.0))
    assert loads(mass=-0.0) != loads(mass=0.0) and loads(mass=np.nan) == loads(mass=np.nan)
    assert record.joint_names == ("a", "b")
    for copied in (copy.deepcopy(record), pickle.loads(pickle.dumps(record))):
        assert copied == record and not copied.force.flags.writeable
    with pytest.raises(AttributeError):
        record.mass = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        record.force[0, 0] = 1.0


def test_plain_data_and_rows_hold_every_bit() -> None:
    record = loads(mass=0.1 + 0.2)
    data = plain(record)
    assert data["force"] == [[1.0, -2.0], [3.0, None]] and data["mass"] == 0.1 + 0.2
    assert Loads(record.joint_names, **from_plain(Loads, data, SIZES)) == record
    row = pack(record)
    assert row.shape == (1 + 4 + 2 + 6,) and row[-1] == record.path[-1, -1]  # the path is last
    assert Loads(record.joint_names, **unpack(Loads, row, SIZES)) == record
    with refused(ParameterError, "row", 12):
        unpack(Loads, row[:12], SIZES)


@pytest.mark.parametrize(
    ("name", "value", "where"),
    [
        ("mass", True, "loads.mass"),
        ("mass", -1.0, "loads.mass"),
        ("mass", 1e200, "loads.mass"),
        ("use", [0.1, 1.5], "loads.use[1]"),
        ("use", 0.1, "loads.use"),
        ("force", [[0.0, 0.0], [0.0]], "loads.force[1]"),
        ("path", [[0.0, None]], "loads.path[0][1]"),
    ],
)
def test_plain_data_that_breaks_a_rule_is_refused(name: str, value: Any, where: str) -> None:
    with refused(ParameterError, where):
        from_plain(Loads, {**plain(loads()), name: value}, SIZES, where="loads")


def test_shapes_and_names_that_break_a_rule_are_refused() -> None:
    with refused(ParameterError, "Loads.force", (3, 2), allowed=(2, 2)):
        loads(force=np.zeros((3, 2)))
    with refused(ParameterError, "Loads.path", (3, 3), allowed=(2,)):
        loads(path=np.zeros((3, 3)))
    data = plain(loads())
    del data["use"]
    with refused(ParameterError, "use", None):
        from_plain(Loads, data, SIZES)
    with refused(UnknownNameError, name="usage"):
        known_quantity(Loads, "usage")
    with pytest.raises(ValueError, match="path"):  # in a netCDF file it would label that axis

        class _Wrong(Record):
            path: Array = quantity("path axis", "m", "places")


def test_the_page_of_quantities_is_that_of_the_classes() -> None:
    script = Path(__file__).parents[1] / "scripts" / "quantities.py"
    subprocess.run([sys.executable, str(script), "--check"], check=True, timeout=120)

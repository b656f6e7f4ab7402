"""Samples that a run records only where they are named: sliding, currents, temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from hexapod_pin.arrays import Array
from hexapod_pin.results.result_files import Column
from hexapod_pin.results.schema import Record, quantity, schema


class RequestedSamples(Record):  # noqa: PLW1641  # no record has a hash
    """T samples of F feet and n joints; what was not named is None, and not there.

    Attributes:
        count: T.
        joint_names: n names.
        foot_names: F names.

    Raises:
        ParameterError: an array has the wrong shape.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "joint": "joint_names", "foot": "foot_names"
    }  # fmt: skip

    count: int
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    # fmt: off
    slip_speed: Array | None = quantity("time foot", "m/s",
        "speed of the contact point along the ground, 0 where the foot is not loaded",
        least=0.0, nan=False, default=None)
    current: Array | None = quantity("time joint", "A",
        "current of the motor: its torque over gear ratio and torque constant; NaN without them",
        default=None)
    temperature: Array | None = quantity("time joint", "deg C",
        "temperature of the motor's winding; NaN where its thermal constants are not known",
        default=None)
    # fmt: on

    def __post_init__(self) -> None:
        """Check shapes, and make read-only what is there."""
        for name in schema(RequestedSamples):
            if getattr(self, name) is None:
                vars(self).pop(name, None)
        super().__post_init__()

    def sizes(self) -> dict[str, int]:
        """Return the length of every axis."""
        return {"time": self.count, **super().sizes()}

    @property
    def arrays(self) -> dict[str, Array]:
        """What is there, by name."""
        return {name: vars(self)[name] for name in schema(RequestedSamples) if name in vars(self)}

    def sampled_columns(self) -> dict[str, Column]:
        """Return what is there as columns of the trace's file."""
        own = self.columns()
        return {name: own[name] for name in self.arrays}

    @classmethod
    def of(
        cls,
        arrays: Mapping[str, Any],
        joint_names: tuple[str, ...],
        foot_names: tuple[str, ...],
    ) -> RequestedSamples | None:
        """Return those among some arrays of a trace, by name; None where there are none."""
        found = {name: arrays[name] for name in schema(cls) if arrays.get(name) is not None}
        if not found:
            return None
        return cls(len(next(iter(found.values()))), joint_names, foot_names, **found)

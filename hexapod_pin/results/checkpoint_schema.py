"""What the dictionary of a checkpoint must be."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo, model_validator

from hexapod_pin.file_schema import FileData, NotNegative, Number, unit_quaternion

BASE = 7
"""Coordinates of the base: place and quaternion."""

LATEST = 1e12
"""Latest time of a run [s]."""


def _configuration(values: list[float], info: ValidationInfo) -> list[float]:
    joints = (info.context or {}).get("joint")
    if len(values) < BASE or joints is not None and len(values) != BASE + joints:
        raise ValueError(f"{BASE} numbers of the base and one per joint")
    if not unit_quaternion(values[3:BASE]):
        raise ValueError("with a quaternion [3:7] of length 1")
    return values


def _memory(values: list[float]) -> list[float]:
    if len(values) not in (6, 10):
        raise ValueError("10 numbers, or 6 without the face that it stands on")
    return values


class CheckpointData(FileData):
    """`Checkpoint.to_dict()`."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

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

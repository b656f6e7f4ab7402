"""What a run tells of itself in files: the `meta` of traces and summaries, and its counters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import (
    Bound,
    FileData,
    Name,
    NotNegative,
    Number,
    check_data,
    per,
)
from hexapod_pin.results.recorded_settings import check_settings
from hexapod_pin.results.summary_schema import NumberErrors, SummaryData

PerJoint = Annotated[list[Bound | None], per("joint")]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]


class EventData(FileData):
    """One of `meta["events"]`."""

    time: NotNegative
    kind: Name
    what: Name
    place: Triple


class DriveData(FileData):
    """`meta["drive"]`: counts and times [s]."""

    limit_count: Annotated[list[NotNegative], per("joint")]
    limit_time: Annotated[list[NotNegative], per("joint")]
    stop_count: Annotated[list[NotNegative], per("joint")]


class LevelStart(FileData):
    """`meta["level_start"]` [m]."""

    ground: Number
    trunk: Number


class RunData(FileData):
    """What a trace and a summary tell of their run: `SUMMARY_META`."""

    run: str | None = None
    scene: str | None = None
    controller: str | None = None
    method: Name | None = None
    accuracy: NotNegative | None = None
    step: NotNegative | None = None
    sample: NotNegative | None = None
    events: list[EventData] = []
    drive: DriveData | None = None
    cycle_time: Annotated[Number, Field(ge=1e-6)] | None = None
    steady_from: Number | None = None
    steady_until: Bound | None = None
    travel_direction: Pair | None = None
    nominal_speed: Number | None = None
    robot_name: Name | None = None
    total_mass: NotNegative | None = None
    gravity: Triple | None = None
    effort_limit: PerJoint | None = None
    joint_kinds: Annotated[list[Name], per("joint")] | None = None
    assumed: list[str] = []
    provenance: str | None = None
    model_digest: str | None = None
    wall_time: NotNegative | None = None
    level_start: LevelStart | None = None
    gait_turn_rate: Number | None = None
    tolerance: NotNegative | None = None
    accuracy_kept: bool | None = None
    error_estimate: Bound | None = None
    number_errors: NumberErrors | None = None


class Counters(FileData):
    """`Trace.counters`, whatever their names."""

    __pydantic_extra__: dict[str, Bound]


class SummaryFile(FileData):
    """The file of a summary; what depends on the number of joints is checked after its names."""

    joint_names: list[Name]
    foot_names: list[Name]
    data: dict[str, Any]
    counters: dict[str, Any]
    meta: dict[str, Any]


class SummaryCounters(FileData):
    """`Summary.counters` in a file, where None stands for what is not finite."""

    __pydantic_extra__: dict[str, Bound | None]


def checked_summary(found: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Check the content of a summary's file; return the names of its joints and feet.

    Raises:
        ParameterError: an entry is missing or breaks its rule.
    """
    check_data(SummaryFile, "summary", found)
    joints, feet = tuple(found["joint_names"]), tuple(found["foot_names"])
    for name, names in (("joint_names", joints), ("foot_names", feet)):
        if len(set(names)) < len(names):
            raise ParameterError(name, list(names), "there once each")
    sizes = {"joint": len(joints), "foot": len(feet)}
    check_data(SummaryData, "data", found["data"], **sizes)
    check_data(RunData, "meta", found["meta"], **sizes)
    check_data(SummaryCounters, "counters", found["counters"])
    check_settings(found["meta"])
    return joints, feet

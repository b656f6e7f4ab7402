"""Files are checked against schemas.

There is one for each of summaries, checkpoints and traces.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy.typing as npt
from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    create_model,
    model_validator,
)

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import (
    ArrayRule,
    Bound,
    FileData,
    Name,
    NotNegative,
    Number,
    check_arrays,
    check_data,
    check_names,
    json_object,
    per,
    text_of,
    unit_quaternion,
)
from hexapod_pin.results.error_estimate import QUANTITIES
from hexapod_pin.results.summary_layout import FOOT, JOINT, LAYOUT, SCALAR
from hexapod_pin.results.trace_layout import BASE_Q, BASE_V, ENERGIES
from hexapod_pin.results.trace_layout import LAYOUT as TRACE_LAYOUT

# What the numbers of a summary must be.

NOT_NEGATIVE = (
    "window_time", "torque_p99", "torque_rms", "limit_use", "speed_rms", "acceleration_rms",
    "positive_energy", "slip_distance", "loaded_time", "friction_work", "height_rms", "heave_rms",
    "roll_rms", "pitch_rms", "roll_rate_rms", "pitch_rate_rms", "vertical_acceleration_rms",
)  # fmt: skip
"""Numbers that have no sign."""

IN_THE_WINDOW = tuple(
    name
    for name, (axes, _, _) in LAYOUT.items()
    if axes in (JOINT, FOOT) and not name.startswith("outside")
)
"""Numbers of joints and feet over whole cycles."""

Known = Number | None
"""None where a number is not known."""

Size = Annotated[Number, Field(ge=0.0)] | None
Share = Annotated[float, Field(ge=0.0, le=1.0 + 1e-9)] | None


def _rising(way: list[list[float]]) -> list[list[float]]:
    if any(later[0] < earlier[0] for earlier, later in zip(way, way[1:], strict=False)):
        raise ValueError("with times that rise")
    return way


def _field(name: str, axes: tuple[str, ...]) -> Any:
    number: Any = Share if name == "at_limit" else Size if name in NOT_NEGATIVE else Known
    if axes == SCALAR:
        return number
    if axes in (JOINT, FOOT):
        return Annotated[list[number], per(axes[0])]
    if axes == ("foot", "axis"):
        triple = Annotated[list[Known], Field(min_length=3, max_length=3)]
        return Annotated[list[triple], per("foot")]
    row = Annotated[list[Number], Field(min_length=4, max_length=4)]
    return Annotated[list[row], AfterValidator(_rising)]


Count = Annotated[int, Field(ge=0, le=10**15)]


class _WholeCycles(FileData):
    """Numbers over a window: where there is one, they are known."""

    @model_validator(mode="after")
    def _are_known(self) -> _WholeCycles:
        numbers = vars(self)
        if numbers["window_time"] and len(numbers["path"]) > 1:
            for name in IN_THE_WINDOW:
                value = numbers.get(name, ())
                if isinstance(value, list) and None in value:
                    raise ValueError(f"with every number of {name}")
        return self


FIELDS: dict[str, Any] = {"cycles": (Count | None, ...), "states": (Count, ...)} | {
    name: (_field(name, axes), ... if name == "path" else None)
    for name, (axes, _, _) in LAYOUT.items()
}

if TYPE_CHECKING:

    class SummaryData(FileData):
        """`Summary.data`."""

else:
    SummaryData = create_model("SummaryData", __base__=_WholeCycles, **FIELDS)


def _errors(errors: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
    """Check that errors have the shapes of their numbers."""
    sizes = {**(info.context or {}), "axis": 3}
    for name, value in errors.items():
        if name not in LAYOUT or "edge" in LAYOUT[name][0]:
            raise ValueError(f"errors of numbers of a summary, not of {name[:40]!r}")
        if not _fits(value, LAYOUT[name][0], sizes):
            raise ValueError(f"an error per number, not negative, of {name}")
    return errors


def _fits(value: Any, axes: tuple[str, ...], sizes: dict[str, int]) -> bool:
    if not axes:
        plain = value is None or isinstance(value, int | float) and not isinstance(value, bool)
        return plain and not (value is not None and value < 0.0)
    if not isinstance(value, list) or len(value) != sizes.get(axes[0], len(value)):
        return False
    return all(_fits(item, axes[1:], sizes) for item in value)


class SummaryErrors(FileData):
    """`Summary.errors`: how far each number may be off."""

    errors: Annotated[dict[str, Any], AfterValidator(_errors)]


# Counters, and the file of a summary.


class Counters(FileData):
    """`Trace.counters`, whatever their names."""

    __pydantic_extra__: dict[str, Bound]


class SummaryFile(FileData):
    """The file of a summary; what depends on the number of joints is checked after its names."""

    joint_names: list[Name]
    foot_names: list[Name]
    data: dict[str, Any]
    errors: dict[str, Any]
    counters: dict[str, Any]
    run: dict[str, Any]
    case: str


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
    check_data(SummaryErrors, "summary", {"errors": found["errors"]}, **sizes)
    check_data(SummaryCounters, "counters", found["counters"])
    return joints, feet


# What the dictionary of a checkpoint must be.

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


# What the file of a trace must hold: rules of its arrays, its `meta` and its counters.

ENERGY, ERROR = "energy_", "error_"
"""How the names of energies and of estimated errors begin."""

DERIVED = "energy_residual"
"""Follows from the others; not read."""

LATEST_SAMPLE = 1e10
"""Of a sample's time [s]: three centuries."""

RULES: dict[str, ArrayRule] = {
    name: ArrayRule(axes, unit) for name, (axes, unit, _) in TRACE_LAYOUT.items()
} | {
    "time": ArrayRule(("time",), "s", least=0.0, most=LATEST_SAMPLE, ascending=True),
    "q": ArrayRule(("time", "q_name"), "m, 1, rad", unit_vector=(3, 7)),
    "foot_normal": ArrayRule(("time", "foot", "axis"), "1", unit_vector=(0, 3)),
}
ENERGY_RULE = ArrayRule(("time",), "J")
ERROR_RULE = ArrayRule(("time",), least=0.0, ascending="weakly")


OPTIONAL = ("summary", "errors", "checkpoint")
"""Texts that a trace need not have."""


class TraceParts(NamedTuple):
    """Texts of a file that were checked."""

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    counters: dict[str, Any]
    run: dict[str, Any]
    case: str
    checkpoint: dict[str, Any] | None
    data: dict[str, Any] | None
    errors: dict[str, Any]


def checked_trace(
    arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str] = ()
) -> TraceParts:
    """Check all variables of a trace's file and return its texts.

    Args:
        arrays: the variables.
        absent: arrays that the file need not hold.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    joints, feet = (
        check_names("joint", arrays.get("joint")),
        check_names("foot", arrays.get("foot")),
    )
    time = arrays.get("time")
    if time is None or time.ndim != 1 or not len(time):
        raise ParameterError("time", None if time is None else time.shape, "at least one time [s]")
    sizes = {
        "time": len(time), "joint": len(joints), "foot": len(feet), "axis": 3,
        "q_name": len(BASE_Q) + len(joints), "v_name": len(BASE_V) + len(joints),
    }  # fmt: skip
    check_arrays(arrays, _rules(arrays, absent), sizes)
    texts = {name: json_object(name, arrays.get(name)) for name in ("run", "counters")}
    more = {name: json_object(name, arrays[name]) for name in OPTIONAL if name in arrays}
    own = {"joint": len(joints), "foot": len(feet)}
    check_data(Counters, "counters", texts["counters"])
    if "checkpoint" in more:
        check_data(CheckpointData, "checkpoint", more["checkpoint"], **own)
    if "summary" in more:
        check_data(SummaryData, "summary", more["summary"], **own)
    check_data(SummaryErrors, "errors", {"errors": more.get("errors", {})}, **own)
    return TraceParts(
        joints, feet, texts["counters"], texts["run"], text_of("case", arrays.get("case")),
        more.get("checkpoint"), more.get("summary"), more.get("errors", {}),
    )  # fmt: skip


def _rules(arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str]) -> dict[str, ArrayRule]:
    """Return the rules of the arrays that are there or must be."""
    rules = {name: rule for name, rule in RULES.items() if name not in absent}
    if "energy" not in absent:
        stored = [name for name in arrays if name.startswith(ENERGY) and name != DERIVED]
        rules |= dict.fromkeys([*(ENERGY + name for name in ENERGIES), *stored], ENERGY_RULE)
    errors = [ERROR + name for name in QUANTITIES if ERROR + name in arrays]
    if errors:
        needed = (ERROR + name for name in ("place", "turn", "joint"))
        rules |= dict.fromkeys([*needed, *errors], ERROR_RULE)
    return rules

"""What the numbers of a summary must be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo, create_model, model_validator

from hexapod_pin.file_schema import FileData, Number, per
from hexapod_pin.results.summary_layout import FOOT, JOINT, LAYOUT, SCALAR

NOT_NEGATIVE = (
    "time", "torque_p99", "torque_rms", "limit_use", "speed_rms", "acceleration_rms",
    "positive_energy", "slip_path", "loaded_time", "friction_work", "height_rms", "heave_rms",
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
        if numbers["time"] and len(numbers["way"]) > 1:
            for name in IN_THE_WINDOW:
                value = numbers.get(name, ())
                if isinstance(value, list) and None in value:
                    raise ValueError(f"with every number of {name}")
        return self


FIELDS: dict[str, Any] = {"cycles": (Count | None, ...), "states": (Count, ...)} | {
    name: (_field(name, axes), ... if name == "way" else None)
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


NumberErrors = Annotated[dict[str, Any], AfterValidator(_errors)]
"""`meta["number_errors"]`: how far each number may be off."""

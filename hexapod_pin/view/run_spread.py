"""Further runs of the case that a page plays: samples for the bands of its plots, what differs.

A band goes from the least to the largest value over all runs at the same sample, so the runs must
have the same times; nothing is interpolated. The page derives what it draws (use of a limit,
tangential force, slip) from the samples of each run by the same code as of the run it plays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.errors import HexapodError, ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.run_data import sampled_data
from hexapod_pin.view.sample_block import SampleBlock
from hexapod_pin.view.scene_graph import feet_of, require_finite

SAME_TIME = 1e-9
"""Times of samples are the same within it [s]."""

MOST_VALUES = 8
"""Values of a parameter that are listed; of more numbers the least and the largest."""

MOST_PARAMETERS = 12
"""Parameters that are listed."""


def require_alike(trace: Trace, spread: Sequence[Trace], name: str = "spread") -> None:
    """Check that runs are of one robot, finite, and sampled at the same times.

    Args:
        trace: the run that is played.
        spread: the others.
        name: of `spread`, for messages.

    Raises:
        ParameterError: other joints, feet or times; names the run.
        ViewerError: a sample that is not finite.
    """
    for k, other in enumerate(spread):
        where = f"{name}[{k}]"
        for what in ("joint_names", "foot_names"):
            found, wanted = (list(getattr(one, what)) for one in (other, trace))
            if found != wanted:
                hint = "Runs of other robots are shown by write_side_by_side."
                allowed = f"{wanted}, as of the run played"
                raise ParameterError(f"{where}.{what}", found, allowed, hint)
        same = len(other.time) == len(trace.time)
        if not same or np.abs(other.time - trace.time).max(initial=0.0) > SAME_TIME:
            hint = "Run all cases for one duration with one time between samples."
            allowed = f"{_times(trace)}, as of the run played"
            raise ParameterError(f"{where}.time", _times(other), allowed, hint)
        try:
            require_finite(other)
        except ViewerError as error:
            raise ViewerError(f"{where}: {error}") from error


def _times(trace: Trace) -> str:
    time = trace.time
    return f"{len(time)} samples from {time[0]:.9g} to {time[-1]:.9g} s"


def spread_data(
    trace: Trace, spread: Sequence[Trace], shapes: RobotShapes, tree: Sequence[Mapping[str, Any]],
    block: SampleBlock, record: MotorRecord | None,
) -> dict[str, Any]:  # fmt: skip
    """Return what a page needs of further runs, and in words what differs between all of them.

    Args:
        trace: the run that is played.
        spread: the others, as `require_alike` has them.
        shapes: of the robot.
        tree: of the run that is played.
        block: takes the samples.
        record: the motor to hold torques against.
    """
    runs = []
    for other in spread:
        feet = feet_of(other, shapes)
        data = sampled_data(other, feet, tree, block, record)
        rows = [{"key": row["key"], "value": row["value"]} for row in data["worst"]]
        runs.append({**data, "feet": feet, "worst": rows})
    return {"runs": runs, "differ": differences([trace, *spread])}


def differences(traces: Sequence[Trace]) -> str:
    """Return which parameters of the runs' cases differ, with their values."""
    try:
        cases = [_leaves(trace.run.case.data) for trace in traces]
    except HexapodError:
        cases = []
    if not all(cases) or not cases:
        return "what differs is not known: a run has no case"
    for trace, case in zip(traces, cases, strict=True):
        case["the robot's data"] = trace.run.robot.digest
    names = list(dict.fromkeys(name for case in cases for name in case))
    found = [
        _varied(name, [case.get(name) for case in cases])
        for name in names
        if any(case.get(name) != cases[0].get(name) for case in cases)
    ]
    if not found:
        return "nothing in their cases differs"
    more = [f"{len(found) - MOST_PARAMETERS} more"] if len(found) > MOST_PARAMETERS else []
    return "they differ in " + "; ".join([*found[:MOST_PARAMETERS], *more])


def _varied(name: str, values: Sequence[Any]) -> str:
    """Return a parameter with its values."""
    plain = [part for part in name.split(".") if part not in ("scene", "controller")]
    name = " ".join(plain).replace("_", " ")
    distinct = list(dict.fromkeys("none" if v is None else v for v in values))
    numbers = [v for v in distinct if isinstance(v, int | float) and not isinstance(v, bool)]
    if len(numbers) == len(distinct) and len(distinct) > MOST_VALUES:
        return f"{name} ({len(distinct)} values, {min(numbers):.6g} to {max(numbers):.6g})"
    texts = [f"{v:.6g}" if v in numbers else str(v) for v in distinct]
    if len(texts) > MOST_VALUES or max(map(len, texts)) > 24:
        return name
    return f"{name} ({', '.join(texts)})"


def _leaves(data: Any, path: str = "") -> dict[str, Any]:
    """Return the values of nested tables by their dotted names; lists of numbers as texts."""
    if isinstance(data, Mapping):
        tables = (_leaves(v, f"{path}.{k}" if path else str(k)) for k, v in data.items())
        return {name: value for table in tables for name, value in table.items()}
    if path in ("schema", "scene.schema", "scene.robot.digest"):
        return {}
    plain = isinstance(data, bool | int | float | str) or data is None
    return {path: data if plain else repr(data)}

"""A study: many cases that differ in a few inputs, made one at a time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.case_data import case_to_dict
from hexapod_pin.simulation.steady_walk import until_steady
from hexapod_pin.study.sweep.base_case import base_case, kept_fields
from hexapod_pin.study.sweep.case_parts import CaseParts
from hexapod_pin.study.sweep.design import INDICES
from hexapod_pin.study.sweep.scene_inputs import StudyMotors
from hexapod_pin.study.sweep.study_file import SCHEMA, StudyInput, read_study_file
from hexapod_pin.user_file import read_text, user_path

MOST_CASES = 10_000_000
"""Most cases of a study."""


@checked
class SweepStudy:
    """The cases of a study file: a grid of its axes, crossed with samples of its uncertain inputs.

    Case i has grid point i // rows and sample i % rows; the last axis of the file changes fastest.
    Every grid point has the same samples, so that differences between points are not noise.
    Build it with `load_sweep` or `SweepStudy.from_toml`.

    Attributes:
        text: of the file.
        folder: where its relative paths start.
        name: of the study.
        base: the case that varies.
        inputs: what varies, in the order of the file.
        design: of the uncertain inputs; None without any.

    Raises:
        ParameterError: the file is not usable; names the place in it.
        UrdfError, UnknownNameError, GaitError: its robot or gait is not.

    Example:
        >>> study = load_sweep("study.toml")
        >>> len(study), study.point(0), study.case(0).run().summary
    """

    def __init__(self, text: str, folder: str | Path | None = None) -> None:
        """Read the text and make the base."""
        file = read_study_file(text)
        self.text, self.folder = text, str(user_path(folder or ".").absolute())
        self.name, self.inputs, self.design = file.name, file.inputs, file.design
        self._axes = [k for k, item in enumerate(self.inputs) if item.distribution is None]
        self._uncertain = [k for k, item in enumerate(self.inputs) if item.distribution]
        self._refuse_too_many()
        place = Path(self.folder)
        self._motors = StudyMotors.of(file.base, place)
        gait = next((item for item in self.inputs if item.name == "gait"), None)
        found = base_case(file.base, place, None if gait is None else gait.names[0])
        servo = self._motors.servo_with(found.scene.servos, {})
        self.base = replace(found, scene=replace(found.scene, servo=servo))
        kept = kept_fields(file.base, self.base)
        self._parts = CaseParts(self.base, self.inputs, kept, self._motors)

    @classmethod
    def from_toml(cls, text: str, folder: str | Path | None = None) -> SweepStudy:
        """Return the study of a text; relative paths start in `folder`, or here."""
        return cls(text, folder)

    @classmethod
    def of_case(
        cls,
        case: Case,
        vary: Sequence[Mapping[str, Any]],
        design: Mapping[str, Any] | None = None,
        *,
        name: str = "study",
    ) -> SweepStudy:
        """Return the study of a case; its text holds the case.

        Args:
            case: what does not vary.
            vary: the tables `[[vary]]` of a study file.
            design: its table `[design]`; None without distributions.
            name: of the study.

        Raises:
            ParameterError: as `SweepStudy`, or the case's controller cannot be written.
        """
        import tomli_w

        data: dict[str, Any] = {
            "schema": SCHEMA,
            "name": name,
            "base": {"case": case_to_dict(case)},
        }
        data["vary"] = [_plain(table) for table in vary]
        if design is not None:
            data["design"] = _plain(design)
        return cls(tomli_w.dumps(data))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle text and folder: the robot is loaded again where it is unpickled."""
        return SweepStudy, (self.text, self.folder)

    def __len__(self) -> int:
        """Return the number of cases."""
        return self.grid_points * self.rows

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the grid's axes, in the order of the file."""
        return tuple(len(self.inputs[k].values) for k in self._axes)

    @property
    def grid_points(self) -> int:
        """Number of points of the grid; 1 without axes."""
        count = 1
        for length in self.shape:
            count *= length
        return count

    @property
    def rows(self) -> int:
        """Rows of the design at each grid point; 1 without uncertain inputs."""
        return 1 if self.design is None else self.design.rows(len(self._uncertain))

    @property
    def axes(self) -> tuple[StudyInput, ...]:
        """Inputs of the grid."""
        return tuple(self.inputs[k] for k in self._axes)

    @property
    def uncertain(self) -> tuple[StudyInput, ...]:
        """Inputs with a distribution."""
        return tuple(self.inputs[k] for k in self._uncertain)

    @property
    def gives_indices(self) -> bool:
        """Whether sensitivity indices can be found from its cases."""
        return self.design is not None and self.design.kind == INDICES

    def point(self, index: int) -> dict[str, float | str]:
        """Return the values of the inputs of a case, by name.

        Raises:
            ParameterError: there is no such case.
        """
        return dict(zip((item.name for item in self.inputs), self._values(index), strict=True))

    def case(self, index: int) -> Case:
        """Return a case; the same index always gives an equal one.

        Raises:
            ParameterError: there is no such case, or it cannot be.
            GaitError: its gait cannot be.
        """
        parts = self._parts.of(self._values(index))
        run = parts.pop("run", {})
        controller = parts.pop("controller", self.base.controller)
        scene = replace(self.base.scene, **parts) if parts else self.base.scene
        changed = replace(self.base, scene=scene, controller=controller, **run, until=None)
        return changed if self.base.until is None else until_steady(changed)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over what the study means: base, robot's content, inputs, design and seed."""
        data = {
            "schema": SCHEMA,
            "base": self.base.digest,
            "inputs": [item.meaning for item in self.inputs],
            "motors": self._motors.meaning(self.inputs),
            "design": None if self.design is None else self.design.model_dump(),
        }
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()

    def _values(self, index: int) -> tuple[float | str, ...]:
        """Return the values of the inputs of a case."""
        count = len(self)
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < count:
            raise ParameterError("index", index, f"a whole number from 0 to {count - 1}")
        grid, row = divmod(index, self.rows)
        values: list[float | str] = [0.0] * len(self.inputs)
        for place in reversed(self._axes):
            axis = self.inputs[place].values
            grid, k = divmod(grid, len(axis))
            values[place] = axis[k]
        for place, column in self._columns.items():
            values[place] = column[row]
        return tuple(values)

    @cached_property
    def _columns(self) -> dict[int, list[float | str]]:
        """The drawn values of each uncertain input, one per row of the design."""
        if self.design is None:
            return {}
        cube = self.design.cube(len(self._uncertain))
        return {
            place: item.distribution.draw(cube[:, k])
            for k, place in enumerate(self._uncertain)
            if (item := self.inputs[place]).distribution is not None
        }

    def _take_drawn(self, drawn: Mapping[str, Sequence[float | str]]) -> None:
        """Take values that were drawn before, one per row: their library takes a second to read.

        Args:
            drawn: of each uncertain input, by its name.
        """
        self._columns = {k: list(drawn[self.inputs[k].name]) for k in self._uncertain}

    def _refuse_too_many(self) -> None:
        if len(self) > MOST_CASES:
            where = "vary" if self.design is None else "vary, design.samples"
            found = f"{self.grid_points} grid points x {self.rows} rows = {len(self)} cases"
            raise ParameterError(where, found, f"{MOST_CASES} cases at most")


@checked
def load_sweep(path: str | Path) -> SweepStudy:
    """Read a study file; relative paths in it start in its folder.

    Raises:
        ParameterError: no such file, or as `SweepStudy`.
        UrdfError, UnknownNameError, GaitError: its robot or gait is not usable.
    """
    text = read_text(path, "study file")
    return SweepStudy(text, user_path(path).absolute().parent)


def _plain(value: Any) -> Any:
    """Return a table with Python's own numbers and lists in the place of NumPy's."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value

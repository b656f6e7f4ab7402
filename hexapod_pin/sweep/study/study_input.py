"""An input of a study with its values or its distribution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hexapod_pin.sweep.study.distribution import Distribution
from hexapod_pin.sweep.study.distributions import Choice
from hexapod_pin.sweep.study.input_kinds import InputKind

PATH = "path"
"""Part of inputs that are a number of the case's file."""


@dataclass(frozen=True)
class StudyInput:
    """An input of a study, with its values or its distribution.

    Attributes:
        name: of the input, or the path of a number in the case's file.
        kind: what it is.
        where: its table in the file: "vary[0]".
        values: of a grid axis; empty of an uncertain input.
        distribution: of an uncertain input; None of a grid axis.
        options: further keys of its table.
    """

    name: str
    kind: InputKind
    where: str
    values: tuple[float | str, ...]
    distribution: Distribution | None
    options: Mapping[str, Any]

    @property
    def unit(self) -> str:
        """Unit of its values; "-" without one, empty of names."""
        return self.kind.unit

    @property
    def names(self) -> tuple[str, ...]:
        """Its values where they are names; empty of numbers."""
        follows = self.distribution.values if isinstance(self.distribution, Choice) else self.values
        return tuple(value for value in follows if isinstance(value, str))

    @property
    def text(self) -> str:
        """Its values in words."""
        if self.distribution is not None:
            return self.distribution.text
        return ", ".join(x if isinstance(x, str) else f"{x:g}" for x in self.values)

    @property
    def meaning(self) -> dict[str, Any]:
        """All that its values follow from, as plain data."""
        follows: Any = list(self.values)
        if self.distribution is not None:
            kind = type(self.distribution).__name__
            follows = {"kind": kind, **self.distribution.model_dump(mode="json")}
        return {"name": self.name, "follows": follows, "options": dict(self.options)}

"""A study file as checked data: what it is called, its base, what varies, and its design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import read_toml
from hexapod_pin.sweep.study.design import Design
from hexapod_pin.sweep.study.distributions import DISTRIBUTIONS, Choice, Distribution
from hexapod_pin.sweep.study.fields import known_name, read_spec, refuse_unknown, table_at
from hexapod_pin.sweep.study.input_kinds import INPUTS, InputKind

SCHEMA = 1
KEYS = ("schema", "name", "base", "vary", "design")
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
    def first(self) -> str | None:
        """The first of its names; None of numbers."""
        follows = self.distribution.values if isinstance(self.distribution, Choice) else self.values
        return follows[0] if follows and isinstance(follows[0], str) else None

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


@dataclass(frozen=True)
class StudyFile:
    """The tables of a study file, checked one by one.

    Attributes:
        name: of the study.
        base: the table of what does not vary, as it stands.
        inputs: what varies.
        design: of the uncertain inputs; None without any.
    """

    name: str
    base: Mapping[str, Any]
    inputs: tuple[StudyInput, ...]
    design: Design | None


def read_study_file(text: str) -> StudyFile:
    """Return the tables of a study file.

    Raises:
        ParameterError: bad syntax, an unknown or missing key, a value out of range, an input
            varied twice, each by its path in the file.
    """
    data = read_toml(text)
    refuse_unknown(data, "", KEYS)
    for key in ("schema", "base", "vary"):
        if key not in data:
            raise ParameterError(key, None, "given: it has no default", _EXAMPLE[key])
    if data["schema"] != SCHEMA or isinstance(data["schema"], bool):
        raise ParameterError("schema", data["schema"], f"{SCHEMA}, which this release reads")
    name = data.get("name", "study")
    if not isinstance(name, str) or not name.strip():
        raise ParameterError("name", name, "text that is not empty")
    inputs = _read_inputs(data["vary"])
    design = _read_design(data, inputs)
    return StudyFile(name, table_at(data["base"], "base"), inputs, design)


_EXAMPLE = {
    "schema": f"Write schema = {SCHEMA} at the top.",
    "base": 'Write [base] with robot = "..." or case = "case.toml".',
    "vary": 'Write [[vary]] with input = "..." and values = [...], once for each input.',
}


def _read_inputs(data: Any) -> tuple[StudyInput, ...]:
    if not isinstance(data, list) or not data:
        raise ParameterError("vary", data, "at least one table [[vary]]", _EXAMPLE["vary"])
    found = tuple(_read_input(table_at(item, f"vary[{k}]"), k) for k, item in enumerate(data))
    first: dict[str, str] = {}
    for item in found:
        key = item.kind.same_as or item.name
        field = f"{item.where}.{'path' if item.kind.part == PATH else 'input'}"
        if key in first:
            raise ParameterError(field, item.name, f"varied once: {first[key]} varies it already")
        first[key] = item.where
    return found


def _read_input(data: Mapping[str, Any], index: int) -> StudyInput:
    where = f"vary[{index}]"
    kind = _kind(data, where)
    own = {key: data[key] for key in data if key not in ("input", "path", *kind.options)}
    options = {key: data.get(key, default) for key, default in kind.options.items()}
    _check_options(options, where)
    distribution, values = None, ()
    if "distribution" in own:
        distribution = _read_distribution(own, where, kind)
    else:
        refuse_unknown(own, where, ("input", "values", "distribution", *kind.options))
        values = _read_values(own.get("values"), where, kind)
    return StudyInput(kind.name, kind, where, values, distribution, options)


def _kind(data: Mapping[str, Any], where: str) -> InputKind:
    """Return which input a table is of."""
    if ("input" in data) == ("path" in data):
        found = "both" if "input" in data else None
        allowed = "given, or path in its place, and only one of them"
        raise ParameterError(f"{where}.input", found, allowed, f"Inputs: {', '.join(INPUTS)}.")
    if "input" in data:
        return INPUTS[known_name(f"{where}.input", data["input"], INPUTS)]
    path = data["path"]
    if not isinstance(path, str) or not path.strip():
        raise ParameterError(f"{where}.path", path, 'a path such as "scene.contact.friction.mu"')
    return InputKind(path, "SI", PATH, "a number of the case's file")


def _check_options(options: Mapping[str, Any], where: str) -> None:
    """Refuse lengths that are none, and what is no name or place."""
    for key, value in options.items():
        if value is None:
            continue
        if key == "link":
            good, allowed = isinstance(value, str), "the name of a link"
        elif key == "position":
            good = isinstance(value, list) and len(value) == 3 and all(map(_finite, value))
            allowed = "three numbers [m]"
        else:
            good = _finite(value) and (value > 0.0 or (key == "flat_radius" and value == 0.0))
            allowed = "a positive number [m]"
        if not good:
            raise ParameterError(f"{where}.{key}", value, allowed)


def _finite(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and math.isfinite(value)  # type: ignore[arg-type]


def _read_values(data: Any, where: str, kind: InputKind) -> tuple[float | str, ...]:
    """Return the values of a grid axis, each in the range of its input, none twice."""
    where = f"{where}.values"
    if not isinstance(data, list) or not data:
        hint = "Or give a distribution." if not kind.words else ""
        raise ParameterError(where, data, f"a list of at least one value ({kind.allowed})", hint)
    for k, value in enumerate(data):
        if not kind.allows(value):
            raise ParameterError(f"{where}[{k}]", value, kind.allowed)
        if value in data[:k]:
            raise ParameterError(f"{where}[{k}]", value, "listed once")
    return tuple(value if isinstance(value, str) else float(value) for value in data)


def _read_distribution(data: Mapping[str, Any], where: str, kind: InputKind) -> Distribution:
    """Return the distribution of an input, which must not leave the input's range."""
    name = known_name(f"{where}.distribution", data["distribution"], DISTRIBUTIONS)
    own = {key: value for key, value in data.items() if key != "distribution"}
    if name == "choice":
        values = _read_values(own.get("values"), where, kind)
        refuse_unknown(own, where, ("values",))
        return Choice(values=values)
    if kind.words or kind.whole:
        what = "names" if kind.words else "whole numbers"
        raise ParameterError(f"{where}.distribution", name, f"choice: {kind.name} takes {what}")
    found = read_spec(DISTRIBUTIONS[name], own, where)
    low, high = found.support
    for key, end, bound, opened in (
        ("low", low, kind.low, kind.open_low),
        ("high", high, kind.high, kind.open_high),
    ):
        outside = end < bound if key == "low" else end > bound
        if not (outside or (end == bound and opened and math.isfinite(end))):
            continue
        if name == "lognormal" and key == "low" and end == 0.0:
            continue  # it never is 0
        given = own.get(key)
        hint = "" if given is not None else f"A {name} distribution has no end of its own there."
        raise ParameterError(f"{where}.{key}", given, f"given so: {kind.allowed}", hint)
    return found


def _read_design(data: Mapping[str, Any], inputs: tuple[StudyInput, ...]) -> Design | None:
    """Return the design, which stands there where an input has a distribution, and only there."""
    uncertain = [item for item in inputs if item.distribution is not None]
    if "design" not in data:
        if uncertain:
            raise ParameterError(
                "design", None, f"given: {uncertain[0].where} has a distribution",
                'Write [design] with kind = "sobol" and samples = 256.',
            )  # fmt: skip
        return None
    table = table_at(data["design"], "design")
    if not uncertain:
        allowed = "left out: no input has a distribution"
        raise ParameterError("design", dict(table), allowed, "A grid needs no design.")
    return read_spec(Design, table, "design")

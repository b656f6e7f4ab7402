"""The tables [[vary]] of a study file, checked one by one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.sweep.study.distribution import Distribution
from hexapod_pin.sweep.study.distributions import DISTRIBUTIONS, Choice
from hexapod_pin.sweep.study.fields import known_name, read_spec, refuse_unknown, table_at
from hexapod_pin.sweep.study.input_kinds import INPUTS, InputKind
from hexapod_pin.sweep.study.study_input import PATH, StudyInput

HINT = 'Write [[vary]] with input = "..." and values = [...], once for each input.'


def read_inputs(data: Any) -> tuple[StudyInput, ...]:
    """Return the inputs of a study.

    Raises:
        ParameterError: an unknown or missing key, a value out of range, or an input varied twice,
            by its path in the file.
    """
    if not isinstance(data, list) or not data:
        raise ParameterError("vary", data, "at least one table [[vary]]", HINT)
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
    distribution: Distribution | None = None
    values: tuple[float | str, ...] = ()
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

"""A study file is read as checked data: base, inputs with values or distributions, design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import read_toml
from hexapod_pin.study.sweep.design import Design
from hexapod_pin.study.sweep.distributions import DISTRIBUTIONS, Choice, Distribution
from hexapod_pin.study.sweep.fields import known_name, read_spec, refuse_unknown, table_at

# The tables [[vary]] of a study file, checked one by one.

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


# The inputs that a study can vary: names, units, ranges, and what of a case each changes.

GAIT, CONTACT, SERVO, TERRAIN, GRAVITY, LOADS = (
    "controller", "contact", "servo", "terrain", "gravity", "loads",
)  # fmt: skip
"""The parts of a case that inputs change."""


@dataclass(frozen=True)
class InputKind:
    """What an input is.

    Attributes:
        name: in the study file.
        unit: of its values; "-" without one, empty of names.
        part: of the case, that it changes.
        meaning: one phrase.
        low: smallest value.
        high: largest value.
        open_low: whether the smallest value itself is refused.
        open_high: whether the largest value itself is refused.
        whole: whether values are whole numbers.
        words: whether values are names.
        options: further keys of its table in the file, with their defaults.
        same_as: name of the input that changes the same number, where there is one.
    """

    name: str
    unit: str
    part: str
    meaning: str
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    open_high: bool = False
    whole: bool = False
    words: bool = False
    options: Mapping[str, float | str | None] = field(default_factory=dict)
    same_as: str = ""

    def allows(self, value: object) -> bool:
        """Return whether a value is in the range of the input."""
        if self.words:
            return isinstance(value, str) and bool(value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        number = float(value)
        above = number > self.low if self.open_low else number >= self.low
        below = number < self.high if self.open_high else number <= self.high
        return math.isfinite(number) and above and below and (not self.whole or number % 1.0 == 0.0)

    @property
    def allowed(self) -> str:
        """The range as text, with its unit."""
        if self.words:
            return "a name"
        low = "" if self.low == -math.inf else f"{'above' if self.open_low else 'at least'} "
        high = "" if self.high == math.inf else f"{'below' if self.open_high else 'at most'} "
        ends = [f"{low}{self.low:g}"] * bool(low) + [f"{high}{self.high:g}"] * bool(high)
        kind = "a whole number" if self.whole else "a number"
        unit = f" [{self.unit}]"
        return f"{kind} {' and '.join(ends)}{unit}" if ends else f"a finite number{unit}"


def _factor(name: str, part: str, of: str) -> InputKind:
    return InputKind(name, "-", part, f"factor on {of}", 0.0, open_low=True)


_MAX_SLOPE = 0.5 * math.pi

_KINDS = (
    InputKind("gait", "", GAIT, "gait by name", words=True),
    InputKind("stroke", "m", GAIT, "stroke", 0.0),
    InputKind("cycle_time", "s", GAIT, "cycle time", 0.0, open_low=True),
    InputKind("duty", "-", GAIT, "share of the cycle on the ground", 0.0, 1.0,
              open_low=True, open_high=True),
    InputKind("lift", "m", GAIT, "height of the swing foot", 0.0),
    InputKind("speed", "m/s", GAIT, "walking speed", 0.0, open_low=True),
    InputKind("heading", "rad", GAIT, "direction of travel, left > 0"),
    InputKind("heading_deg", "deg", GAIT, "direction of travel, left > 0", same_as="heading"),
    InputKind("turn_rate", "rad/s", GAIT, "yaw rate, left > 0"),
    InputKind("turn_rate_deg", "deg/s", GAIT, "yaw rate, left > 0", same_as="turn_rate"),
    InputKind("payload", "kg", LOADS, "mass of a payload", 0.0,
              options={"link": None, "position": None}),
    InputKind("mu", "-", CONTACT, "friction coefficient", 0.0),
    _factor("mass", LOADS, "mass and inertia of all links"),
    _factor("trunk_mass", LOADS, "mass and inertia of the trunk"),
    _factor("contact_stiffness", CONTACT, "the stiffness of the contact"),
    _factor("servo_stiffness", SERVO, "stiffness and damping of the servos"),
    InputKind("motor", "", SERVO, "motor of the catalogue", words=True),
    InputKind("voltage", "V", SERVO, "voltage of the supply", 0.0, open_low=True),
    InputKind("slope", "rad", GRAVITY, "slope of the ground, rising along +x",
              -_MAX_SLOPE, _MAX_SLOPE, open_low=True, open_high=True),
    InputKind("slope_deg", "deg", GRAVITY, "slope of the ground, rising along +x",
              -90.0, 90.0, open_low=True, open_high=True, same_as="slope"),
    InputKind("bumps", "m", TERRAIN, "largest height and depth of random bumps", 0.0,
              options={"wavelength": 0.4, "length": None, "flat_radius": None}),
    InputKind("bumps_seed", "-", TERRAIN, "which random bumps", 0.0, 2.0**53, whole=True),
)  # fmt: skip

INPUTS: Mapping[str, InputKind] = MappingProxyType({kind.name: kind for kind in _KINDS})
"""The inputs by name."""


# An input of a study with its values or its distribution.

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
        """Its values as text."""
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


# A study file as checked data: what it is called, its base, what varies, and its design.

SCHEMA = 1
KEYS = ("schema", "name", "base", "vary", "design")


@dataclass(frozen=True)
class StudyFile:
    """The tables of a study file, checked one by one.

    Attributes:
        name: of the study.
        base: the table of what does not vary, unchecked.
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
    inputs = read_inputs(data["vary"])
    design = _read_design(data, inputs)
    return StudyFile(name, table_at(data["base"], "base"), inputs, design)


_EXAMPLE = {
    "schema": f"Write schema = {SCHEMA} at the top.",
    "base": 'Write [base] with robot = "..." or case = "case.toml".',
    "vary": HINT,
}


def _read_design(data: Mapping[str, Any], inputs: tuple[StudyInput, ...]) -> Design | None:
    """Return the design, which is required where an input has a distribution, and only there."""
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

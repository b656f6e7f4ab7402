"""Arguments of public calls: what is not allowed ends in one error that names call and argument."""

from __future__ import annotations

import inspect
import random
import re
import typing
from collections import abc
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from fuzz import sound
from fuzz.public_names import (
    CONSTRUCTOR,
    LEFT_OUT,
    METHOD,
    PublicCall,
    public_calls,
)
from numpy.typing import ArrayLike
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arguments import checked, every_step
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.type_checks import _Unknown, type_hints

SCENE = hp.Scene(hp.load_robot("kharagpur"))


@checked
def call(
    number: float = 0.0,
    *,
    count: int = 1,
    truth: bool = False,
    text: str = "",
    path: str | Path = "",
    several: Sequence[float] = (),
    pair: tuple[float, str] = (0.0, ""),
    table: Mapping[str, Sequence[int]] | None = None,
    array: ArrayLike | None = None,
    choice: Literal["a", "b"] = "a",
    function: Callable[[], None] | None = None,
    taken: abc.Iterable[int] = (),
    scene: hp.Scene | None = None,
) -> float:
    return number


@pytest.mark.parametrize(
    ("where", "value", "part", "allowed"),
    [
        ("number", "1", "", "a float"), ("number", True, "", "a float"),
        ("number", float("nan"), "", "finite"), ("count", 1.0, "", "an int"),
        ("count", False, "", "an int"), ("truth", 1, "", "a bool"), ("text", b"x", "", "a str"),
        ("path", b"x", "", "a path"), ("path", "a\0b", "", "without a null character"),
        ("several", "12", "", "a sequence"), ("several", {1.0: 2.0}, "", "a sequence"),
        ("several", [1.0, "3"], "[1]", "a float"), ("pair", (1.0,), "", "2 values"),
        ("pair", ("x", "y"), "[0]", "a float"), ("table", [1], "", "a mapping"),
        ("table", {"a": [1, 2.5]}, "[a][1]", "an int"), ("table", {3: [1]}, "[3]", "a str"),
        ("array", "12", "", "numbers"), ("array", [[1.0], [1.0, 2.0]], "", "rows of one length"),
        ("choice", "c", "", "'a', 'b'"), ("function", 3, "", "callable"),
        ("taken", [1, None], "[1]", "an int"), ("scene", "kharagpur", "", "a Scene"),
    ],
)  # fmt: skip
def test_a_wrong_kind_is_named_with_its_place(where: str, value: Any, part: str, allowed: str):
    with pytest.raises(ParameterError) as caught:
        call(**{where: value})
    assert caught.value.name == f"call.{where}{part}"
    assert caught.value.value is value or part
    assert allowed in caught.value.allowed


def test_a_checked_call_is_otherwise_the_call_itself():
    """An iterator is not used up; Python's own errors, signature and documentation stay."""
    assert call(1) == 1 and call(np.float32(1.0)) == 1.0
    numbers = iter([1, 2])
    call(
        count=np.int64(2), truth=np.bool_(True), path=Path("x"), several=np.array([1.0]),
        array=np.inf, function=print, taken=numbers, scene=SCENE,
    )  # fmt: skip
    assert list(numbers) == [1, 2]
    with refused(TypeError, about=("'numbre'",)):
        call(numbre=1.0)
    assert list(inspect.signature(hp.simulate).parameters)[:2] == ["scene", "controller"]
    assert "Run a scene under a controller" in (hp.simulate.__doc__ or "")


METHODS = {
    "class method": (lambda: hp.robot.Segment.rod(None, 0.1, 0.01, (0.0, 1.0), 1.0, 1.0),
         "Segment.rod.mass"),
    "static method": (lambda: hp.Contact.preset([]), "Contact.preset.name"),
    "parameter set": (lambda: hp.Contact.s1().with_mu("x"), "Contact.with_mu.mu"),
    "list for an array": (lambda: hp.motion.Sine(amplitude=1.0, period=1.0).value_and_rate([0.0]),
         "Sine.value_and_rate.time"),
    "ragged": (lambda: hp.Flat().height_at([[1.0, 2.0], [3.0]], 0.0), "height_at.x"),
    "shapes": (lambda: hp.Flat().height_at([1.0, 2.0], [1.0, 2.0, 3.0]), "height_at.x, y"),
    "generator": (lambda: hp.motion.VelocityCommand(time=[0.0], forward=[0.1]).gaits(3),
         "VelocityCommand.gaits.gait"),
}  # fmt: skip


@pytest.mark.parametrize("kind", METHODS)
def test_a_method_names_the_argument_that_made_it_fail(kind: str) -> None:
    """Methods ended in bare TypeErrors, AttributeErrors and ValueErrors of NumPy."""
    method, where = METHODS[kind]
    with pytest.raises(ParameterError) as caught:
        method()
    assert where in caught.value.name


@checked
class Own:
    """Fails in ways of its own."""

    def divide(self, by: float) -> float:
        return 1.0 / by

    @every_step
    def step(self, by: float) -> float:
        return 1.0 / by

    def fail(self) -> float:
        raise ValueError("own words")

    def refuse(self) -> float:
        raise ParameterError("by", 2.0, "another")

    @property
    def two(self) -> int:
        return 2

    def power(self, number: float, power: float = 1.0, names: Sequence[str] = ()) -> float:
        if not names:
            np.exp(np.asarray([number]))
        return float(f"{number:g}") ** power


def test_what_a_method_raises_itself_passes_unchanged() -> None:
    """Only a wrong argument is another error; what runs first is its cause."""
    own = Own()
    assert (own.divide(2.0), own.two) == (0.5, 2)
    assert own.power(2.0, 2.0, np.array(["a"])) == 4.0  # an array of names that is not false
    with refused(ValueError, args=("own words",)):
        own.fail()
    with refused(ParameterError, "by"):
        own.refuse()
    with refused(TypeError, about=("Own.divide", "'by'")):
        own.divide()  # type: ignore[call-arg]
    with refused(ParameterError, "Own.divide.by", __cause__=None):
        own.divide("x")  # type: ignore[arg-type]
    with refused(ParameterError, "Own.step.by") as caught:
        own.step("x")  # type: ignore[arg-type]
    assert isinstance(caught.value.__cause__, TypeError)


@pytest.mark.parametrize(
    ("given", "where", "value"),
    [
        ((0.0, -1.0), "number, power", (0.0, -1.0)), ((10.0, 1e9), "number, power", (10.0, 1e9)),
        ((Fraction(1, 3),), "number", Fraction(1, 3)), ((2**70,), "number", 2**70),
        ((1.0, 1.0, np.array([])), "names", None),
    ],
    ids=["division", "overflow", "a fraction", "beyond 64 bits", "an array of names"],
)  # fmt: skip
def test_what_cannot_be_computed_is_an_error_of_the_arguments(given, where, value) -> None:
    with pytest.raises(ParameterError) as caught:
        Own().power(*given)
    assert caught.value.name == f"Own.power.{where}"
    assert value is None or caught.value.value == value
    assert isinstance(caught.value.__cause__, ArithmeticError) is ("," in where)


# every public call ----------------------------------------------------------------------------

AT_EVERY_STEP = {"Command()", "Measurement()", "FootControl.update", "FirmwareControl.update"}
"""What a run calls at every step: checked where it is used, or when it has failed."""

PATH = re.compile(r"[A-Za-z_]\w*(\.\w+|\[[^\]]*\])*(, \w+)*")
"""What the name of a parameter looks like."""


CALLS = {
    name: one for name, one in public_calls().items()
    if one.is_called and name not in LEFT_OUT and not getattr(one.owner, "_is_protocol", False)
    and not (isinstance(one.owner, type) and issubclass(one.owner, BaseException | tuple))
}  # fmt: skip


def test_what_is_not_checked_when_it_is_called() -> None:
    marked = {name for name, one in public_calls().items() if one.is_called
              and hasattr(one.target, "_every_step")}  # fmt: skip
    assert marked == AT_EVERY_STEP


ODD: tuple[Any, ...] = (
    True, 1.5, "1.5", None, {1: 2}, object(), [None], np.array("x"), np.zeros(2, complex),
)  # fmt: skip


def fits(kind: Any, value: Any, *, table: bool) -> bool:
    """Tell whether a value may be of a type, by rules written anew; in doubt it is."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return fits(parts[0], value, table=table)
    if parts and "nion" in getattr(origin, "__name__", str(origin)):
        return any(fits(part, value, table=table) for part in parts)
    plain = {
        float: (float, int, np.number), int: (int, np.integer), bool: (bool,), str: (str,),
        Path: (str, Path), type(None): (type(None),),
    }  # fmt: skip
    if kind in plain:
        return isinstance(value, plain[kind]) and (kind is bool or not isinstance(value, bool))
    if origin in (dict, abc.Mapping):
        return isinstance(value, dict) and all(fits(parts[0], key, table=table) for key in value)
    if origin in (tuple, list, abc.Sequence, abc.Collection, abc.Iterable):
        items = isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim > 0)
        return items and all(fits(parts[0], one, table=table) for one in value)
    kind = origin or kind
    if kind is np.ndarray:
        return isinstance(value, int | float | list | np.ndarray)
    unknown = getattr(kind, "_is_protocol", False) or kind is _Unknown
    if unknown or not isinstance(kind, type) or not kind.__module__.startswith("hexapod_pin"):
        return True
    if table and hasattr(kind, "model_fields") and isinstance(value, dict):
        return True
    return isinstance(value, kind)


def kinds(one: PublicCall) -> Iterator[tuple[str, Any]]:
    fields = getattr(one.owner, "model_fields", {}) if one.kind == CONSTRUCTOR else {}
    target: Any = one.owner.__init__ if one.kind == CONSTRUCTOR else one.target
    hints = type_hints(target, one.owner if isinstance(one.owner, type) else None)
    for name in one.odd_parameters():
        yield name, hints.get(name, fields[name].annotation if name in fields else Any)


@pytest.mark.parametrize("name", sorted(CALLS.keys() - AT_EVERY_STEP))
def test_odd_arguments_end_in_one_error_that_names_a_path(name: str) -> None:
    """What cannot be of an argument's type is refused; nothing ends in another exception."""
    one = CALLS[name]
    instances = sound.instances(one.owner) if isinstance(one.owner, type) else [None]
    if not instances and one.kind == METHOD:
        return
    own = instances[:1] if one.kind == METHOD else []
    table, optional = hasattr(one.owner, "model_fields"), getattr(one.owner, "_may_be_none", ())
    for argument, kind in kinds(one):
        given = sound.arguments(one, random.Random(argument), (instances or [None])[0])
        for value in ODD:
            if fits(kind, value, table=table) or (value is None and argument in optional):
                continue
            with pytest.raises(HexapodError) as caught:
                one.target(*own, **{**given, argument: value})
                pytest.fail(f"{argument} = {value!r} is taken")
            if isinstance(caught.value, ParameterError):
                assert PATH.fullmatch(caught.value.name), caught.value

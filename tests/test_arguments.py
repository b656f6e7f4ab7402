"""Arguments of public calls: a wrong kind ends in one error that names call and argument."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike
from public_surface import surface
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arguments import checked, every_step
from hexapod_pin.errors import ParameterError

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
    taken: Iterable[int] = (),
    scene: hp.Scene | None = None,
) -> float:
    """Return the number."""
    return number


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("number", "1", "a float"), ("number", True, "a float"), ("number", float("nan"), "finite"),
        ("number", float("-inf"), "finite"), ("number", 1j, "a float"), ("count", 1.0, "an int"),
        ("count", False, "an int"), ("truth", 1, "a bool"), ("text", b"x", "a str"),
        ("path", b"x", "a path"), ("path", "a\0b", "without a null character"),
        ("several", "12", "a sequence"), ("several", 3.0, "a sequence"),
        ("several", {1.0: 2.0}, "a sequence"), ("pair", (1.0,), "2 values"),
        ("table", [1], "a mapping"), ("array", "12", "numbers"),
        ("array", [[1.0], [1.0, 2.0]], "all rows of one length"), ("choice", "c", "'a', 'b'"),
        ("function", 3, "callable"), ("taken", 3, "a sequence"), ("scene", "kharagpur", "a Scene"),
    ],
)  # fmt: skip
def test_a_wrong_kind_is_named(name: str, value: object, allowed: str):
    with pytest.raises(ParameterError) as caught:
        call(**{name: value})
    assert caught.value.name == f"call.{name}"
    assert caught.value.value is value
    assert allowed in caught.value.allowed


@pytest.mark.parametrize(
    ("name", "value", "where"),
    [
        ("several", [1.0, 2.0, "3"], "call.several[2]"), ("pair", ("x", "y"), "call.pair[0]"),
        ("table", {"a": [1, 2.5]}, "call.table[a][1]"), ("table", {3: [1]}, "call.table[3]"),
        ("taken", [1, None], "call.taken[1]"),
    ],
)  # fmt: skip
def test_a_wrong_part_is_named_with_its_place(name: str, value: object, where: str):
    with pytest.raises(ParameterError) as caught:
        call(**{name: value})
    assert caught.value.name == where


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("number", 1), ("number", np.float32(1.0)), ("count", np.int64(2)),
        ("truth", np.bool_(True)), ("path", Path("x")), ("several", np.array([1.0, 2.0])),
        ("table", None), ("array", [[1, 2], [3, 4]]), ("array", np.inf), ("function", print),
        ("taken", iter([1])), ("scene", SCENE),
    ],
)  # fmt: skip
def test_what_will_do_is_passed_on(name: str, value: object):
    assert call(**{name: value}) == (value if name == "number" else 0.0)


def test_a_checked_call_is_otherwise_the_call_itself():
    """An iterator is not used up; Python's own errors, signature and documentation stay."""
    numbers = iter([1, 2])
    call(taken=numbers)
    assert list(numbers) == [1, 2]
    with refused(TypeError, about=("'numbre'",)):
        call(numbre=1.0)
    assert list(inspect.signature(hp.simulate).parameters)[:2] == ["scene", "controller"]
    assert "Run a scene under a controller" in (hp.simulate.__doc__ or "")


NAMES_OF_CLASSES = {"State", "Scene", "Case", "Session", "HoldPosture", "KinematicControl"}


def functions() -> list[str]:
    """Return the names of all public functions."""
    return [name for name, value in surface().items() if inspect.isfunction(value)]


@pytest.mark.parametrize("name", [*functions(), *sorted(NAMES_OF_CLASSES)])
def test_every_public_call_refuses_an_object_of_no_kind(name: str):
    """The first argument that it requires is checked first."""
    public = surface()[name]
    required = [
        parameter.name
        for parameter in inspect.signature(public).parameters.values()
        if parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
    ]
    if required:
        with pytest.raises(ParameterError) as caught:
            public(**dict.fromkeys(required, object()))
        assert caught.value.name == f"{public.__name__}.{required[0]}"


METHODS = {
    "class method": (lambda: hp.robot.Segment.rod(None, 0.1, 0.01, (0.0, 1.0), 1.0, 1.0),
         "Segment.rod.mass"),
    "static method": (lambda: hp.Contact.preset([]), "Contact.preset.name"),
    "parameter set": (lambda: hp.Contact.s1().with_mu("x"), "Contact.with_mu.mu"),
    "record": (lambda: hp.load_catalog().get(3), "Catalog.get.model"),
    "path": (lambda: hp.load_catalog().save(b"x"), "Catalog.save.path"),
    "list for an array": (lambda: hp.motion.Sine(amplitude=1.0, period=1.0).value_and_rate([0.0]),
         "Sine.value_and_rate.time"),
    "ragged": (lambda: hp.Flat().height_at([[1.0, 2.0], [3.0]], 0.0), "height_at.x"),
    "shapes": (lambda: hp.Flat().height_at([1.0, 2.0], [1.0, 2.0, 3.0]), "height_at.x, y"),
}  # fmt: skip


@pytest.mark.parametrize("kind", METHODS)
def test_a_method_names_the_argument_that_made_it_fail(kind: str) -> None:
    """Methods ended in bare TypeErrors, AttributeErrors and ValueErrors of NumPy."""
    call, where = METHODS[kind]
    with pytest.raises(ParameterError) as caught:
        call()
    assert where in caught.value.name


def test_a_generator_checks_its_arguments_when_it_is_called() -> None:
    command = hp.motion.VelocityCommand(time=[0.0], forward=[0.1])
    with pytest.raises(ParameterError) as caught:
        command.gaits(3)
    assert caught.value.name == "VelocityCommand.gaits.gait"


def test_what_a_method_raises_itself_passes_unchanged() -> None:
    """Only a wrong argument is another error; what runs first is its cause."""

    @checked
    class Own:
        def divide(self, by: float) -> float:
            return 1.0 / by

        @every_step
        def step(self, by: float) -> float:
            return 1.0 / by

        def fail(self, by: float) -> float:
            raise ValueError("own words")

        def refuse(self, by: float) -> float:
            raise ParameterError("by", by, "another")

        @property
        def two(self) -> int:
            return 2

    own = Own()
    assert (own.divide(2.0), own.two) == (0.5, 2)
    with refused(ValueError, args=("own words",)):
        own.fail(0.0)
    with refused(TypeError, about=("Own.divide", "'by'")):
        own.divide()  # type: ignore[call-arg]
    with pytest.raises(ParameterError) as caught:
        own.divide("x")  # type: ignore[arg-type]
    assert caught.value.name == "Own.divide.by"
    assert caught.value.__cause__ is None
    with pytest.raises(ParameterError) as caught:
        own.step("x")  # type: ignore[arg-type]
    assert caught.value.name == "Own.step.by"
    assert isinstance(caught.value.__cause__, TypeError)
    with pytest.raises(ParameterError) as caught:
        own.refuse(2.0)
    assert caught.value.name == "by"


def fails(number: float, power: float = 1.0, names: Sequence[str] = ()) -> float:
    """Fail on what its annotations allow."""
    if not names:
        np.exp(np.asarray([number]))
    return float(f"{number:g}") ** power


@checked
class Fails:
    """The same as a method."""

    def fails(self, number: float, power: float = 1.0, names: Sequence[str] = ()) -> float:
        """Call it."""
        return fails(number, power, names)


NOT_COMPUTED = {
    "division": ((0.0, -1.0), "number, power", (0.0, -1.0)),
    "overflow": ((10.0, 1e9), "number, power", (10.0, 1e9)),
    "a fraction": ((Fraction(1, 3),), "number", Fraction(1, 3)),
    "beyond 64 bits": ((2**70,), "number", 2**70),
    "an array of names": ((1.0, 1.0, np.array([])), "names", None),
}


@pytest.mark.parametrize("name", NOT_COMPUTED)
@pytest.mark.parametrize("public", [checked(fails), Fails().fails])
def test_what_cannot_be_computed_is_an_error_of_the_arguments(public: Any, name: str) -> None:
    given, where, value = NOT_COMPUTED[name]
    with pytest.raises(ParameterError) as caught:
        public(*given)
    error = caught.value
    assert error.name.removeprefix("Fails.") == f"fails.{where}"
    assert value is None or error.value == value
    by_arithmetic = isinstance(error.__cause__, ArithmeticError)
    assert by_arithmetic == (name in ("division", "overflow"))


def test_an_array_that_is_not_false_is_a_list_of_names() -> None:
    """Only a call that fails is explained."""
    assert checked(fails)(2.0, 2.0, np.array(["a"])) == 4.0

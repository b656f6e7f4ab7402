"""Errors and data survive pickles and copies: type, message, attributes, bits, immutability."""

from __future__ import annotations

import copy
import inspect
import pickle
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
import public_samples
import pytest
from public_surface import surface
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    DivergenceError,
    HexapodError,
    NotPicklableError,
    ParameterError,
    SimulationInterrupted,
)
from tests.same_content import differences, error_types, one_of

COPIES: dict[str, Callable[[Any], Any]] = {
    **{
        f"pickle-{protocol}": lambda x, protocol=protocol: pickle.loads(pickle.dumps(x, protocol))
        for protocol in (2, pickle.HIGHEST_PROTOCOL)
    },
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}  # fmt: skip

COMPARED_IN_PART = ("Command", "HeightGrid", "JointTrajectory", "Measurement",
                    "MotorBudget", "MotorRanking", "MotorSelection")  # fmt: skip
"""Types whose `==` is that of a dataclass over arrays, or over records compared by identity."""


# ---- errors ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", error_types(), ids=lambda kind: kind.__name__)
def test_every_error_survives(kind: type[HexapodError]) -> None:
    error = one_of(kind)
    parameters = inspect.signature(kind.__init__).parameters.keys() - {"self"}
    for how, copied in COPIES.items():
        again = copied(error)
        assert again is not error and type(again) is kind and str(again) == str(error), how
        assert not list(differences(error.args, again.args)), how
        before, after = (dict(sorted(vars(one).items())) for one in (error, again))
        assert before and not list(differences(before, after)), how
        for name in parameters:  # ImportError keeps some elsewhere
            values = (getattr(one, name, None) for one in (error, again))
            assert not list(differences(*values, name)), how


class _LaterError(ParameterError):
    """A type added later, whose constructor shares nothing with that of its base."""

    def __init__(self, *, leg: str) -> None:
        self.leg = leg
        super().__init__("angle", 0.1, f"possible for {leg}")


def test_a_type_of_error_added_later_survives() -> None:
    error = _LaterError(leg="lf")
    for again in (copied(error) for copied in COPIES.values()):
        assert (type(again), str(again), vars(again)) == (_LaterError, str(error), vars(error))


def test_what_cannot_be_pickled_arrives_as_its_text() -> None:
    """A value that a worker refuses may be anything; the error must still arrive as itself."""
    lock = threading.Lock()
    again = pickle.loads(pickle.dumps(ParameterError("x", lock, "a number")))
    assert type(again) is ParameterError and again.value == repr(lock) and again.name == "x"
    again = pickle.loads(pickle.dumps(HexapodError(lambda: None)))
    assert type(again) is HexapodError and "lambda" in again.args[0]
    assert copy.copy(ParameterError("x", lock, "a number")).value is lock
    error = HexapodError("what holds a value that nothing can show")
    error.trace = Nameless()
    assert "Nameless" in pickle.loads(pickle.dumps(error)).trace


class Nameless:
    """Has no text and cannot be pickled."""

    def __repr__(self) -> str:
        """Fail."""
        raise ValueError("no text")

    __reduce__ = __repr__  # type: ignore[assignment]


def test_errors_that_hold_traces_errors_or_themselves_survive() -> None:
    trace, lock = public_samples.trace(), threading.Lock()
    again = pickle.loads(pickle.dumps(DivergenceError("left the finite world", trace)))
    assert again.trace.digest == trace.digest
    inner = ParameterError("x", lock, "a number")
    again = pickle.loads(pickle.dumps(SimulationInterrupted("Ctrl-C", None, [1.5, inner])))
    assert again.results[0] == 1.5 and again.results[1].value == repr(lock)
    error = HexapodError("a cycle")
    error.trace = [error]
    for copied in COPIES.values():
        again = copied(error)
        assert again.trace[0] is (error if copied is copy.copy else again)


# ---- data --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """One or two of each type of public data, by its name."""
    found: dict[str, list[Any]] = {}
    roots = public_samples.samples(tmp_path_factory.mktemp("samples"))
    for one in public_samples.within(roots, set()):
        found.setdefault(type(one).__name__, []).append(one)
    return {name: several[:2] for name, several in found.items()}


PUBLIC = [
    name.rpartition(".")[2]
    for name, kind in sorted(surface().items())
    if inspect.isclass(kind) and Protocol not in kind.__mro__[1:]
    and name not in ("Session", "rl.WalkEnv", "rl.WalkVectorEnv")
]  # fmt: skip
"""Public types of data: all but what is to be implemented, and runs under way."""

GIVEN_BACK = ("AssumedInput", "ErrorEstimate", "Foot", "FootPath", "JointTrajectory", "Leg",
              "SobolIndices", "TrunkPoints", "HeightGrid")  # fmt: skip
"""Further types that public calls and attributes give."""


@pytest.mark.parametrize("name", [*PUBLIC, *GIVEN_BACK])
def test_public_data_survives(name: str, samples: dict[str, list[Any]]) -> None:
    """Every bit, what may be written to, and equality where the type defines it."""
    assert samples.get(name), f"public_samples has no {name}"
    for one in samples[name]:
        assert not list(differences(one, one))
        for how, copied in COPIES.items():
            again = copied(one)
            assert not list(differences(one, again)), how
            if type(one).__eq__ is not object.__eq__ and name not in COMPARED_IN_PART:
                assert again == one, how


def test_a_copied_robot_finds_its_file_and_meshes_from_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process may work in another folder than the one that loaded the robot."""
    (tmp_path / "there").mkdir()
    (tmp_path / "r.urdf").write_text(public_samples.robot().urdf)
    monkeypatch.chdir(tmp_path)
    robot = hp.load_robot("r.urdf", package_path=["meshes"])
    sent, text = pickle.dumps(robot), hp.Scene(robot).to_toml()
    monkeypatch.chdir(tmp_path / "there")
    again = pickle.loads(sent)
    assert Path(again.source) == tmp_path / "r.urdf"
    assert list(again.options["package_path"]) == [str(tmp_path / "meshes")]
    assert hp.Scene(again).to_toml() == text
    assert hp.Scene.from_toml(text).robot.digest == robot.digest


def test_copies_are_as_immutable_and_share_nothing_that_can_be_written_to() -> None:
    trace = pickle.loads(pickle.dumps(public_samples.trace()))
    for array in (trace.q, trace.energy["kinetic"], trace.error.place, trace.checkpoint.q):
        with refused(ValueError, about=("read-only",)):
            array[0] = 0.0
    assert isinstance(trace.energy, MappingProxyType)
    robot = copy.deepcopy(public_samples.robot())
    with refused(ValueError, about=("read-only",)):
        robot.feet[0].offset[0] = 1.0
    with pytest.raises(AttributeError):
        trace.q = trace.v
    robot.model.inertias[1].mass = 9.0
    assert public_samples.robot().model.inertias[1].mass != 9.0
    copied = copy.deepcopy(trace)
    copied.run.versions["hexapod-pin"] = "none"
    assert trace.run.versions["hexapod-pin"] != "none"


def test_a_pickled_trace_is_about_as_large_as_what_it_holds() -> None:
    trace = replace(public_samples.case(), sample=None).run()
    size = sum(array.nbytes for array in vars(trace).values() if isinstance(array, np.ndarray))
    size += sum(array.nbytes for array in trace.energy.values())
    size += sum(array.nbytes for array in vars(trace.error).values())
    size += sum(array.nbytes for array in trace.peaks.prefixed.values())
    assert len(pickle.dumps(trace)) < 1.05 * (size + len(repr(trace.run)))


def test_scenes_are_equal_when_they_mean_the_same() -> None:
    """Also of robots loaded twice: a robot comes back from a pool as another object."""
    robots = [hp.load_robot("kharagpur") for _ in range(2)]
    one, other = (hp.Scene(robot) for robot in robots)
    assert one == other and hash(one) == hash(other)
    assert one != hp.Scene(robots[0], terrain=hp.Flat(height=0.1)) and one != "a scene"


def test_a_session_names_what_to_send_instead() -> None:
    session = hp.Session(public_samples.scene(), accuracy=1e-2)
    session.advance(0.01)
    for copied in COPIES.values():
        with refused(NotPicklableError, "Session", instead="Session.checkpoint()") as caught:
            copied(session)
        assert isinstance(caught.value, TypeError)
    sent = pickle.loads(pickle.dumps((public_samples.scene(), session.checkpoint())))
    ahead = hp.Session(sent[0], initial=sent[1], accuracy=1e-2)
    for one in (session, ahead):
        one.advance(0.02)
    assert ahead.checkpoint() == session.checkpoint()

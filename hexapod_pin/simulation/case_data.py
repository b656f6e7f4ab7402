"""What a case holds: one run as data, its TOML form, and the digest that identifies it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hexapod_pin.arrays import read_only
from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.registry import controller_to_dict, read_controller, table
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.run_facts import left_out, recorded_groups
from hexapod_pin.robot.robot_source import PACKAGED
from hexapod_pin.robot.state import State
from hexapod_pin.scene.canonical_text import TEXTS, canonical_text, joined
from hexapod_pin.scene.scene import Scene, scene_parts, scene_text
from hexapod_pin.simulation.methods import (
    DEFAULT_ACCURACY,
    DEFAULT_METHOD,
    DEFAULT_TORQUE_ACCURACY,
)
from hexapod_pin.simulation.run_settings import RunSettings, WorkLimits
from hexapod_pin.spec import read_toml

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller

Kind = TypeVar("Kind", bound="CaseData")
"""A kind of case."""


SCHEMA = 1
SETTINGS = (
    "duration", "until", "accuracy", "torque_accuracy", "estimate", "method", "step", "sample",
    "record",
)  # fmt: skip
ROBOT = ("source", "feet", "foot_radius", "posture", "digest", "options")


STEADY = "steady"
"""Of a case that runs until a cycle repeats."""


@dataclass(frozen=True, eq=False)
class CaseData(Immutable):
    """What a `Case` holds, and what it means; the fields are described there."""

    scene: Scene
    controller: Controller | FeedbackController
    initial: State | Checkpoint | None = None
    duration: float | None = field(default=None, kw_only=True)
    until: str | None = field(default=None, kw_only=True)
    accuracy: float | None = field(default=None, kw_only=True)
    torque_accuracy: float | str | None = field(default=None, kw_only=True)
    estimate: bool | None = field(default=None, kw_only=True)
    method: str | None = field(default=None, kw_only=True)
    step: float | None = field(default=None, kw_only=True)
    sample: float | None = field(default=None, kw_only=True)
    record: Sequence[str] | None = field(default=None, kw_only=True)
    limits: WorkLimits | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Check the settings against each other."""
        if self.until not in (None, STEADY):
            raise ParameterError("until", self.until, f"{STEADY!r} or None")
        object.__setattr__(self, "record", recorded_groups(self.record))
        self._settings(0.0 if self.duration is None else self.duration)

    def _settings(self, duration: float) -> RunSettings:
        return RunSettings.of(
            duration, self._method, *self._accuracies, self.sample, self._estimated, self.limits
        )

    @cached_property
    def _feedback(self) -> bool:
        return isinstance(self.controller, FeedbackController)

    @cached_property
    def _carries_error(self) -> bool:
        """Whether a run of the usual method knows its error.

        Not under set-points that jump often: such a run begins a new history at each of them.
        """
        jumps = self._feedback or isinstance(self.controller, SampledTrajectory)
        return not jumps and self.scene.carries_errors

    @property
    def _method(self) -> str | None:
        """The method given, or the usual one; None: `resolve_method` decides without the scene."""
        usual = self.method is None and self.step is None and self._carries_error
        return DEFAULT_METHOD if usual else self.method

    @property
    def _accuracies(self) -> tuple[float | None, float | str | None, float | None]:
        """Accuracies of positions and torques, and the step, as given; the usual where none is."""
        given = (self.accuracy, self.torque_accuracy, self.step)
        nothing = self.method is None and all(value is None for value in given)
        if nothing and "torque" not in left_out(self.record) and self._carries_error:
            return DEFAULT_ACCURACY, DEFAULT_TORQUE_ACCURACY, None
        return given

    @property
    def _estimated(self) -> bool:
        """Whether the error of the whole run is estimated."""
        if self.estimate is None:
            return not self._feedback
        return self.estimate

    @property
    def settings_key(self) -> tuple[Any, ...]:
        """The settings of the integration."""
        return (self.method, self.accuracy, self.torque_accuracy, self.estimate, self.step)

    @property
    def settings(self) -> RunSettings:
        """The method with its accuracy or step, and the times of the samples.

        Raises:
            ParameterError: the case has no duration.
        """
        if self.duration is None:
            raise ParameterError("Case.duration", None, "given [s]")
        settings = self._settings(self.duration)
        method = settings.method_settings.for_scene(self.scene, feedback=self._feedback)
        return replace(settings, method_settings=method)

    def with_defaults(
        self: Kind,
        *,
        duration: float | None = None,
        accuracy: float | None = None,
        estimate: bool | None = None,
        method: str | None = None,
        step: float | None = None,
        sample: float | None = None,
        limits: WorkLimits | None = None,
    ) -> Kind:
        """Return the case with settings for those that it leaves open.

        Method, accuracy and step belong together: a case that gives one of them keeps its own.

        Raises:
            ParameterError: they do not fit together.
        """
        given: dict[str, Any] = {}
        if self.duration is None:
            given["duration"] = duration
        if self.sample is None:
            given["sample"] = sample
        if self.limits is None:
            given["limits"] = limits
        if estimate is not None:
            given["estimate"] = estimate
        own = (self.method, self.accuracy, self.torque_accuracy, self.step)
        if all(value is None for value in own):
            given |= {"accuracy": accuracy, "method": method, "step": step}
        if all(value is None for value in given.values()):
            return self
        return replace(self, **given)

    @property
    def digest(self) -> str:
        """SHA-256 over what the case means, whatever its spelling.

        The robot counts with its file's content, not with its place; defaults count as what they
        stand for.

        Raises:
            ParameterError: the controller cannot be written.
        """
        return self._digest

    @cached_property
    def _digest(self) -> str:
        return case_digest(self)

    def __eq__(self, other: object) -> bool:
        """Tell whether both mean the same run."""
        return isinstance(other, CaseData) and self._key() == other._key()

    def __hash__(self) -> int:
        """Return a hash of what the case means."""
        return hash(self._key())

    def _key(self) -> object:
        """Return the digest; of a case that cannot be written, what it is made of."""
        try:
            return self._digest
        except ParameterError:
            rest = (self.duration, self.until, self.settings_key, self.sample, self.record)
            return (id(self.scene), id(self.controller), id(self.initial), *rest)


# A case as plain data, and as TOML text.


def case_to_dict(case: CaseData, folder: Path | None = None) -> dict[str, Any]:
    """Return the TOML-able form; paths below `folder` are relative to it.

    Raises:
        ParameterError: the controller cannot be written.
    """
    run = run_to_dict(case)
    data = {
        **{name: run[name] for name in ("schema", "run")},
        "controller": controller_to_dict(case.controller),
        "scene": case.scene.to_dict(),
    }
    source = Path(data["scene"]["robot"]["source"])
    if folder is not None and source.is_absolute() and folder in source.parents:
        robot = {**data["scene"]["robot"], "source": source.relative_to(folder).as_posix()}
        data["scene"] = {**data["scene"], "robot": robot}
    return data | ({"initial": run["initial"]} if "initial" in run else {})


def run_to_dict(case: CaseData) -> dict[str, Any]:
    """Return the settings and the start of a case, without scene and controller."""
    given = {name: getattr(case, name) for name in SETTINGS if getattr(case, name) is not None}
    if "record" in given:
        given["record"] = list(given["record"])
    data: dict[str, Any] = {"schema": SCHEMA, "run": given}
    if case.initial is not None:
        data["initial"] = _initial_to_dict(case.initial)
    return data


def _initial_to_dict(initial: State | Checkpoint) -> dict[str, Any]:
    if isinstance(initial, Checkpoint):
        return {"kind": "checkpoint", **_without_none(initial.to_dict())}
    q, v = (np.asarray(x, dtype=float).tolist() for x in (initial.q, initial.v))
    return {"kind": "state", "q": q, "v": v}


def _without_none(value: Any) -> Any:
    """Return plain data as TOML can hold it: None, which TOML does not have, as a table."""
    if value is None:
        return {"__none__": True}
    if isinstance(value, Mapping):
        return {key: _without_none(item) for key, item in value.items()}
    return [_without_none(item) for item in value] if isinstance(value, list) else value


def _with_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        if value.get("__none__") is True:
            return None
        return {key: _with_none(item) for key, item in value.items()}
    return [_with_none(item) for item in value] if isinstance(value, list) else value


def read_case(case: type[Kind], text: str, folder: str | Path | None = None) -> Kind:
    """Build a case from its TOML text; see `Case.from_toml`."""
    return case_from_dict(case, read_toml(text), folder)


def case_from_dict(
    case: type[Kind], data: Mapping[str, Any], folder: str | Path | None = None
) -> Kind:
    """Build a case from the data of its TOML text."""
    given = table(
        data, "case", required=("schema", "run", "controller", "scene"), optional=("initial",)
    )
    if given["schema"] != SCHEMA:
        raise ParameterError("case.schema", given["schema"], f"{SCHEMA}, which this release reads")
    run = table(given["run"], "run", optional=SETTINGS)
    with within("controller"):
        controller = read_controller(given["controller"])
    with within("scene"):
        scene = _read_scene(given["scene"], folder)
    with within("initial"):
        initial = _read_initial(given["initial"]) if "initial" in given else None
    with within("run"):
        return case(scene, controller, initial, **run)


@contextmanager
def within(section: str) -> Iterator[None]:
    """Put the name of a section in front of what a ParameterError names."""
    try:
        yield
    except ParameterError as error:
        if error.name.startswith((f"{section}.", f"{section}:")):
            raise
        name = f"{section}: {error.name}"
        raise ParameterError(name, error.value, error.allowed, error.hint) from error
    except HexapodError:
        raise
    except (TypeError, ValueError, KeyError, OverflowError) as error:
        raise ParameterError(section, None, f"readable ({error})") from error


def _read_scene(data: Any, folder: str | Path | None) -> Scene:
    known = tuple(field.name for field in fields(Scene))
    given = table(data, "scene", required=("robot",), optional=("schema", *known))
    robot = table(given["robot"], "scene.robot", required=("source",), optional=ROBOT)
    source = robot["source"]
    if not isinstance(source, str):
        raise ParameterError("scene.robot.source", source, "a name or a path")
    if folder is not None and source not in PACKAGED and os.path.isfile(Path(folder) / source):
        robot["source"] = str(Path(folder) / source)
    return Scene(**scene_parts({**given, "robot": robot}))


def _read_initial(data: Any) -> State | Checkpoint:
    kind = data.get("kind") if isinstance(data, Mapping) else None
    if kind == "checkpoint":
        return Checkpoint.from_dict(_with_none({k: x for k, x in data.items() if k != "kind"}))
    if kind != "state":
        raise ParameterError("initial.kind", kind, "state or checkpoint")
    given = table(data, "initial", required=("kind", "q", "v"))
    return State(read_only(given["q"]), read_only(given["v"]))


# The SHA-256 over what a case means.
#
# Parts that many cases share (robot, contact, servos, stops, terrain, walk) are spelt once.

FIXED = (KinematicControl, ArcWalk)
"""Controllers that never change: their text is cached."""


def case_digest(case: CaseData) -> str:
    """Return the SHA-256 over what a case means.

    Raises:
        ParameterError: the controller cannot be written.
    """
    run = run_to_dict(case)
    settings = case._settings(0.0 if case.duration is None else case.duration)
    arguments = {
        "duration": case.duration,
        "method": settings.method_settings.method.name,
        "accuracy": settings.method_settings.accuracy,
        "step": settings.grid.step,
        "sample": settings.grid.sample,
        **({} if case.until is None else {"until": case.until}),
        **({} if case.record is None else {"record": list(case.record)}),
        **(
            {}
            if settings.estimate or not settings.method_settings.method.adaptive
            else {"estimate": False}
        ),
        **settings.method_settings.torque_request,
    }
    parts = {
        "schema": canonical_text(run["schema"]),
        "run": canonical_text(arguments),
        "controller": _controller_text(case.controller),
        "scene": scene_text(case.scene),
    }
    if "initial" in run:
        parts["initial"] = canonical_text(run["initial"])
    return hashlib.sha256(joined(parts).encode()).hexdigest()


def _controller_text(controller: Any) -> str:
    def text(given: Any) -> str:
        return canonical_text(controller_to_dict(given))

    return TEXTS.of(controller, text) if isinstance(controller, FIXED) else text(controller)

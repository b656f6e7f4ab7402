"""A case: what is run, from where, for how long and how; data that can be written and repeated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.recording import recorded_groups
from hexapod_pin.simulation.case_data import case_to_dict, read_case
from hexapod_pin.simulation.case_digest import case_digest
from hexapod_pin.simulation.run_settings import RunSettings
from hexapod_pin.simulation.work_limits import WorkLimits
from hexapod_pin.user_code import user_callback
from hexapod_pin.user_file import read_text, user_path

if TYPE_CHECKING:
    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene


@checked(but="record")
@dataclass(frozen=True, eq=False)
class Case(Immutable):
    """One run as data. Two cases are equal when they mean the same run.

    Attributes:
        scene: robot, ground, contact, servos, loads.
        controller: as of `simulate`.
        initial: state at the start, or a checkpoint to go on from; None: standing.
        duration: simulated time [s]; None where `simulate_batch` gives one for all.
        accuracy: as of `simulate` [m and rad].
        torque_accuracy: as of `simulate` [N m, or a share of the peak such as "1 %"].
        estimate: as of `simulate`.
        method: as of `simulate`.
        step: as of `simulate` [s].
        sample: as of `simulate` [s].
        record: as of `simulate`; kept as a tuple, None where everything is recorded.
        limits: as of `simulate`; no part of what the case means, and of no file.

    Raises:
        ParameterError: a setting is out of range, or they do not fit together.

    Example:
        >>> case = Case(Scene(load_robot("athena")), HoldPosture(), duration=2.0)
        >>> case.save("case.toml")
        >>> load_case("case.toml") == case
        True
    """

    scene: Scene
    controller: Controller | FeedbackController
    initial: State | Checkpoint | None = None
    duration: float | None = field(default=None, kw_only=True)
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
        for name in ("duration", "accuracy", "step", "sample"):
            value = getattr(self, name)
            if value is not None and (
                isinstance(value, bool) or not isinstance(value, int | float)
            ):
                raise ParameterError(f"Case.{name}", value, "a number")
        if self.method is not None and not isinstance(self.method, str):
            raise ParameterError("Case.method", self.method, "a name")
        if self.estimate is not None and not isinstance(self.estimate, bool):
            raise ParameterError("Case.estimate", self.estimate, "true or false")
        object.__setattr__(self, "record", recorded_groups(self.record))
        self._settings(0.0 if self.duration is None else self.duration)

    def _settings(self, duration: float) -> RunSettings:
        return RunSettings.of(
            duration, self.method, self.accuracy, self.step, self.sample, self.torque_accuracy,
            self._estimated, self.limits,
        )  # fmt: skip

    @property
    def _estimated(self) -> bool:
        """Whether the error of the whole run is estimated."""
        if self.estimate is None:
            return not isinstance(self.controller, FeedbackController)
        return self.estimate

    @property
    def settings_key(self) -> tuple[Any, ...]:
        """What says how it is integrated."""
        return (self.method, self.accuracy, self.torque_accuracy, self.estimate, self.step)

    @property
    def settings(self) -> RunSettings:
        """How it is run: the method with its number, and the times of its samples.

        Raises:
            ParameterError: the case has no duration.
        """
        if self.duration is None:
            raise ParameterError("Case.duration", None, "given [s]")
        how = self._settings(self.duration)
        return replace(how, choice=replace(how.choice, sensitive=self.scene.sensitive))

    def with_defaults(
        self,
        *,
        duration: float | None = None,
        accuracy: float | None = None,
        estimate: bool | None = None,
        method: str | None = None,
        step: float | None = None,
        sample: float | None = None,
        limits: WorkLimits | None = None,
    ) -> Case:
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
        return isinstance(other, Case) and self._key() == other._key()

    def __hash__(self) -> int:
        """Return a hash of what the case means."""
        return hash(self._key())

    def _key(self) -> object:
        """Return the digest; of a case that cannot be written, what it is made of."""
        try:
            return self._digest
        except ParameterError:
            rest = (self.duration, self.settings_key, self.sample, self.record)
            return (id(self.scene), id(self.controller), id(self.initial), *rest)

    def run(self, progress: Callable[[float], None] | None = None) -> Trace:
        """Run the case; returns and raises as `simulate`."""
        from hexapod_pin.simulation.run import run_case

        return run_case(self, user_callback("progress", progress))

    def to_toml(self) -> str:
        """Return the case as TOML text; numbers keep every bit.

        Raises:
            ParameterError: the controller cannot be written: no `to_dict`, or not registered.
        """
        import tomli_w

        return tomli_w.dumps(case_to_dict(self))

    @classmethod
    @checked
    def from_toml(cls, text: str, folder: str | Path | None = None) -> Case:
        """Rebuild a case from its text; the robot is loaded again.

        Args:
            text: what `to_toml` gave, or what was written like it.
            folder: where a relative path of a robot's file starts, if not here.

        Raises:
            ParameterError: bad TOML, an unknown or missing key, a value out of range, each with
                its path; or a robot file that has changed since.
            UrdfError, UnknownNameError: the robot, or something in it, is not there.
        """
        return read_case(cls, text, folder)

    def save(self, path: str | Path) -> Path:
        """Write the case to a TOML file, wholly or not at all, and return its path.

        A robot's file in the same folder or below is named relative to it, so that both can move
        together; any other by its absolute path.

        Raises:
            ParameterError: the controller cannot be written.
            TraceFileError: the file cannot be written.
        """
        import tomli_w

        text = tomli_w.dumps(case_to_dict(self, user_path(path).absolute().parent))
        return write_atomically(path, text.encode())


@checked
def load_case(path: str | Path) -> Case:
    """Read a case that `Case.save` wrote, or a text written like it.

    Raises:
        ParameterError: no such file, or as `Case.from_toml`.
        UrdfError, UnknownNameError: the robot, or something in it, is not there.
    """
    text = read_text(path, "case file")
    return Case.from_toml(text, user_path(path).absolute().parent)

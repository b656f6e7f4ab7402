"""One run of the native core: set up, advanced, read and commanded, turned into a trace.

Python never sits inside a step: it hands a run over and takes the samples back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from copy import copy, deepcopy
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.drive_law import followed_motors, torque_limit
from hexapod_pin.errors import (
    HexapodError,
    ParameterError,
    SimulationInterrupted,
    UserCodeError,
)
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE
from hexapod_pin.results.run_facts import left_out
from hexapod_pin.results.samples import ENERGIES, PeakStates, RequestedSamples
from hexapod_pin.results.schema import schema
from hexapod_pin.results.trace import Trace
from hexapod_pin.scene.loaded_model import native_loads
from hexapod_pin.simulation.methods import check_supported
from hexapod_pin.simulation.plant import (
    native_acceleration,
    native_plant,
)
from hexapod_pin.simulation.run_outcome import (
    contact_names,
    failure,
    plain_counters,
    run_record,
    run_summary,
    with_urdf,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.results.error_estimate import ErrorEstimate
    from hexapod_pin.results.summary import Summary
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.run_settings import RunSettings

PROGRESS_INTERVAL = 0.2
"""Simulated time between two checks for Ctrl-C and two calls of the progress bar [s]."""

TABLES = {"energy": (*ENERGIES, "push_work")}
"""Tables of the core by the array of a trace that holds them, where they differ."""

OF_START = ("q or v", "contact memories", "impulses", "a command in force")
"""How messages of the core begin about a start that does not fit the scene."""

TIME_ROUNDING = 1e-9
"""Share of its time, or of a sampling interval, by which a start may miss a sample and be it."""

MOST_ROUNDING = 0.25
"""And of sampling intervals at most, however late it is."""


MOST_FREE_TURN, MOST_EVENTS = 1.0, 40
"""Where an error is carried along: how far the robot may turn while no foot touches [rad], and how
many touch-downs, slips and switches may follow each other within 0.05 s [-], of which walks have up
to 20."""


class NativeRun:
    """A run: a native rollout and the data for its trace."""

    def __init__(
        self,
        scene: Scene,
        settings: RunSettings,
        start: Checkpoint,
        set_points: JointTrajectory,
        *,
        controller: Mapping[str, Any] | None = None,
        record: bool = True,
        groups: Sequence[str] | None = None,
        extend_plan: Callable[[Any, float], None] | None = None,
    ) -> None:
        """Check and set up; nothing is simulated yet.

        Args:
            scene: what is simulated.
            settings: method and sampling.
            start: where it starts.
            set_points: what the drives follow until a command arrives.
            controller: for the trace: what controls the run, as TOML-able data.
            record: whether samples are recorded.
            groups: of arrays that the samples hold, as of `recorded_groups`.
            extend_plan: gives a rollout more set-points than these, which are the first part, up to
                a time [s] and beyond; None: they are all.
        """
        check_supported(settings.method_settings, scene)
        self.scene, self.settings, self.set_points, self.start = scene, settings, set_points, start
        self.controller = deepcopy(dict(controller or {"kind": "commands"}))
        self.trunk_points = native_loads(scene.robot, scene.settings).trunk_points
        self.recorded = record
        self.omitted = left_out(groups)
        self._motors = followed_motors(
            scene.robot, scene.servos,
            current="current" not in self.omitted, temperature="temperature" not in self.omitted,
        )  # fmt: skip
        self.extend_plan = extend_plan
        self._plant = native_plant(scene)
        self.rollout = self._start(start, record)
        self.loop: Any = None
        self.case_settings: dict[str, Any] | None = None  # of the case, where it is one
        self.standing_height: float | None = None  # of a run that goes on, where it began [m]
        self.good = True
        self.wall_time = 0.0

    def _start(self, start: Checkpoint, record: bool) -> Any:
        from hexapod_pin import native as _native

        points, settings = self.set_points, self.settings
        rows = self._followed_rows(start)
        limit = np.asarray(self.scene.robot.velocity_limit, dtype=float)
        arguments: dict[str, Any] = dict(
            plant=self._plant,
            time=points.time[rows].tolist(),
            position=np.ascontiguousarray(points.q[rows], dtype=float),
            rate=np.ascontiguousarray(points.v[rows], dtype=float),
            kind=points.kind,
            acceleration=native_acceleration(points),
            start=_native.checkpoint(
                samples_before(start.time, settings.grid.sample), start.time, start.q, start.v,
                start.contacts, start.controller, start.command, start.impulse,
            ),
            method=settings.method_settings.method.name,
            step=settings.grid.step,
            stride=settings.grid.stride,
            sample=settings.grid.sample,
            tolerance=settings.method_settings.tolerance,
            refinement=settings.method_settings.tolerance_ratio,
            dense=settings.method_settings.refinement is None,  # a run that is not compared
            record=record,
            rate_limit=np.where(limit > 0.0, limit, np.inf),
            trunk=[(place, radius) for _, place, radius, _ in self.trunk_points],
            window=np.array(summary_window(points)),
            torque_limit=LIMITED_TORQUE_SHARE * torque_limit(self.scene.robot, self.scene.servos),
            evaluations=settings.evaluations,
            smallest_step=settings.limits.smallest_step,
            wall_time=settings.limits.wall_time,
            estimates=self.carries_error,
            end=start.time + settings.duration if settings.duration else math.inf,
            motors=self._motors,
        )  # fmt: skip
        tables = [TABLES.get(array, (array,)) for array in self.omitted]
        arguments["omitted"] = [name for names in tables for name in names]
        try:
            return _native.start(**arguments)
        except ValueError as error:  # what only the core knows: a method that cannot do a scene
            if str(error).startswith(OF_START):
                raise ParameterError(
                    "initial", "this checkpoint", f"of this scene: {error}"
                ) from None
            raise ParameterError(
                "method", settings.method_settings.method.name, str(error)
            ) from None

    def _followed_rows(self, start: Checkpoint) -> slice:
        """Return which knots of the set-points a run from here to its end comes by.

        All where they may be extended or replaced, or know their accelerations.
        """
        points, length = self.set_points, self.settings.duration
        if self.extend_plan is not None or points.kind != "cubic" or not length:
            return slice(None)
        first = int(np.searchsorted(points.time, start.time, side="right")) - 1
        last = int(np.searchsorted(points.time, start.time + length, side="right")) + 1
        return slice(max(0, first - 1), max(2, last))

    def with_settings(self, settings: RunSettings) -> NativeRun:
        """Return a run of the same scene from the same start, with other settings."""
        return self._again(settings, self.start, self.omitted)

    def continued(
        self, settings: RunSettings, start: Checkpoint, groups: Sequence[str] | None
    ) -> NativeRun:
        """Return a run of the same scene and set-points from another start; it records `groups`."""
        return self._again(settings, start, left_out(groups))

    def _again(
        self, settings: RunSettings, start: Checkpoint, omitted: tuple[str, ...]
    ) -> NativeRun:
        other = copy(self)
        other.settings, other.start, other.omitted = settings, start, omitted
        other.wall_time, other.good = 0.0, True
        other.rollout = other._start(start, self.recorded)
        return other

    @property
    def time(self) -> float:
        """Simulated time reached [s]."""
        return float(self.rollout.time)

    @property
    def carries_error(self) -> bool:
        """Whether the run carries its own error along."""
        chosen = self.settings.method_settings
        return self.settings.estimate and chosen.carries_error and chosen.refinement is not None

    @property
    def follows_error(self) -> bool:
        """Whether the error that the run has carried along so far is to be trusted.

        Not where a joint has been at its limits, the robot has turned in the air, touch-downs,
        slips and switches follow each other so fast that some may be missed, or the error has
        grown too large for a linearised motion.
        """
        if not self.carries_error:
            return False
        limits, _, stops = self.rollout.drive_counters()
        counters = self.rollout.counters()
        followed = (
            counters["free_turn"] <= MOST_FREE_TURN
            and counters["burst"] <= MOST_EVENTS
            and not counters["error_lost"]
        )
        return followed and not any(limits) and not any(stops)

    def advance(self, progress: Callable[[float], None] | None = None) -> None:
        """Run to the end in chunks, between which Ctrl-C and a progress bar are served.

        Raises:
            SimulationInterrupted: Ctrl-C; the samples so far are in the error.
            HexapodError: of `progress`, or of what plans a part; they are in it, too.
        """
        begin = time.perf_counter()
        done, samples = 0, self.settings.grid.samples
        self.rollout.reserve(samples)
        chunk = max(1, round(PROGRESS_INTERVAL / self.settings.grid.sample))
        try:
            while done < samples and self.good:
                part = min(chunk, samples - done)
                share = done / samples
                if self.extend_plan is not None:
                    self.extend_plan(self.rollout, self.time + part * self.settings.grid.sample)
                self.good = self.rollout.advance(part, progress and partial(progress, share))
                done += part
                if progress is not None:
                    progress(done / samples)
        except (KeyboardInterrupt, SimulationInterrupted):
            self.wall_time += time.perf_counter() - begin
            raise self.interrupted() from None
        except HexapodError as error:
            self.wall_time += time.perf_counter() - begin
            self.attach_trace(error)
            raise
        self.wall_time += time.perf_counter() - begin

    def interrupted(self) -> SimulationInterrupted:
        """Return the error of a run that Ctrl-C has ended, with its samples if it records any."""
        trace = self.trace() if self.recorded else None
        end = self.time if trace is None else trace.time[-1]
        return SimulationInterrupted(f"interrupted after {end:g} s of simulated time", trace)

    def attach_trace(self, error: HexapodError) -> None:
        """Put the samples so far into an error that ends the run, where it records any."""
        if isinstance(error, UserCodeError) and error.time is None:
            error.time = self.time
        if self.recorded and self.time > self.start.time:
            error.trace = self.trace()

    def checkpoint(self) -> Checkpoint:
        """Return where the run stands."""
        now = self.rollout.checkpoint()
        return Checkpoint(
            now.time, now.q, now.v, now.contacts, tuple(now.controller), now.command, now.impulse,
            self.loop,
        )  # fmt: skip

    def trace(
        self,
        error: ErrorEstimate | None = None,
        counters: Mapping[str, int | float] | None = None,
        numerics: Mapping[str, Any] | None = None,
        errors: Mapping[str, Any] | None = None,
    ) -> Trace:
        """Return the samples so far, with their estimated error.

        Args:
            error: of the samples.
            counters: more of them.
            numerics: more `Numerics`, and "wall_time" in place of the run's own.
            errors: of the summary's numbers.
        """
        summary = self.summary(counters, numerics, errors)
        record = self.rollout.record()
        for samples in record.values():  # own memory of each array: the trace takes them over
            samples.flags.writeable = False
        names = contact_names(self.scene)
        flat = ("q", "v", "torque", "q_ref", "v_ref", "com", "foot_gap")
        arrays: dict[str, Any] = {name: record[name] for name in flat}
        for name in ("foot_position", "foot_force", "foot_normal", "foot_impulse"):
            if name not in self.omitted:
                arrays[name] = record[name].reshape(-1, len(names), 3)
        energies = [*ENERGIES, *(["push_work"] if self.scene.loads else [])]
        if "energy" not in self.omitted:
            arrays["energy"] = {name: record[name][:, 0] for name in energies}
        asked = schema(RequestedSamples).keys() - {*self.omitted}
        arrays |= dict.fromkeys(name for name in self.omitted if name in schema(Trace))
        arrays |= {"energy": None} if "energy" in self.omitted else {}
        joints, peaks = self.scene.robot.joint_names, None
        if "torque" not in self.omitted:
            peaks = PeakStates.of_rows(self.rollout.peak_states(), joints, names)
        return Trace(
            time=record["time"][:, 0],
            **arrays,
            counters=summary.counters,
            joint_names=joints,
            foot_names=names,
            run=with_urdf(summary.run, self),
            error=error,
            gathered=summary,
            peaks=peaks,
            requested=RequestedSamples.of({k: record[k] for k in asked}, joints, names),
        )

    def samples(self) -> dict[str, Array]:
        """Return the samples whose errors are estimated, as arrays of a trace."""
        record, feet = self.rollout.record(), len(contact_names(self.scene))
        found = {"q": record["q"]}
        if "torque" not in self.omitted:
            found["torque"] = record["torque"]
        if "foot_force" not in self.omitted:
            found["foot_force"] = record["foot_force"].reshape(-1, feet, 3)
        return found

    def carried_error(self) -> dict[str, Array]:
        """Return the error that the run has carried along so far, as arrays of an estimate."""
        place, turn, joint, torque, force = self.rollout.record()["error"].T
        found = {"place": place, "turn": turn, "joint": joint}
        if "torque" not in self.omitted:
            found["torque"] = torque
        if "foot_force" not in self.omitted:
            found["foot_force"] = force
        return {name: np.maximum.accumulate(error) for name, error in found.items()}

    def summary(
        self,
        counters: Mapping[str, int | float] | None = None,
        numerics: Mapping[str, Any] | None = None,
        errors: Mapping[str, Any] | None = None,
    ) -> Summary:
        """Return the summary so far; arguments as of `trace`."""
        record, more = run_record(self), dict(numerics or {})
        changed: dict[str, Any] = {}
        if "wall_time" in more:
            changed["wall_time"] = more.pop("wall_time")
        if more:
            changed["numerics"] = record.numerics.model_copy(update=more)
        record = record.model_copy(update=changed) if changed else record
        return run_summary(self, record, {**plain_counters(self), **(counters or {})}, errors or {})

    def require_good_so_far(self) -> None:
        """Do nothing where the run is good.

        Raises:
            DivergenceError: as `require_good`.
        """
        if not self.good:
            raise failure(self, self.trace() if self.recorded else None)

    def require_good(self, trace: Trace | None = None) -> Trace:
        """Return the trace, or the one already made.

        Raises:
            DivergenceError: the state is no longer finite, or the run was ended by its limits; the
                error names the joint and foot that caused it.
        """
        trace = self.trace() if trace is None else trace
        if self.good:
            return trace
        raise failure(self, trace)


def begin_of(
    initial: State | Checkpoint | None, settings: RunSettings, tick: float = math.inf
) -> float:
    """Return when a run begins [s].

    Args:
        initial: where it starts.
        settings: its samples, its steps and its duration.
        tick: period of a controller that takes part in it [s].

    Raises:
        ParameterError: so late that its samples, steps or ticks are too close to each other for
            double precision; or it would end so late.
    """
    begin = initial.time if isinstance(initial, Checkpoint) else 0.0
    latest = settings.grid.latest(tick)
    parts = {"samples": settings.grid.sample, "steps": settings.grid.step, "ticks": tick}
    word = min((name for name in parts if parts[name]), key=lambda name: parts[name])
    allowed = f"at most {latest:g} s, where {word} {parts[word]:g} s apart still advance the clock"
    if begin > latest:
        raise ParameterError("initial.time", begin, allowed)
    if begin + settings.duration > latest:
        where = "duration" if not begin else "initial.time + duration"
        raise ParameterError(where, begin + settings.duration, allowed)
    return begin


def summary_window(points: JointTrajectory) -> tuple[float, float, float]:
    """Return begin, end and cycle of a summary [s]: whole cycles, else the second half of a run."""
    if points.cycle_time is not None:
        return points.steady_from, points.steady_until, points.cycle_time
    return 0.5 * (points.steady_from + points.steady_until), np.inf, 0.0


def samples_before(start: float, sample: float) -> int:
    """Return how many sampling intervals end by a time [s]."""
    count = start / sample
    nearest = np.rint(count)
    missed = min(TIME_ROUNDING * (1.0 + count), MOST_ROUNDING)
    return int(nearest if abs(nearest - count) <= missed else np.floor(count))

"""Native runs at one time, side by side: what they read and what they are told, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.check_controller import called_at
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.run_failure import contact_names

ROUNDING = 1e-9
"""How far a set-point may be beyond its range for rounding [rad, rad/s]."""

NO_ROWS = np.zeros((0, 0))
UNITS = {"q": "rad", "v": "rad/s", "torque": "N m"}


class LockStep:
    """B runs that are advanced, read and commanded together.

    A run that diverges drops out: its row of a measurement stays what it was, and what it is
    commanded does not matter.
    """

    def __init__(self, runs: Sequence[NativeRun], threads: int = 1) -> None:
        """Take runs of one kind of robot; they stand at one time. So many advance at a time."""
        self.runs, self.threads = list(runs), threads
        self.robot = self.runs[0].scene.robot
        self.time = max(run.time for run in self.runs)
        self._shape = (len(self.runs), len(self.robot.joint_names))
        self._feet = len(self.robot.feet)
        self._limits = {
            "q": (self.robot.lower - ROUNDING, self.robot.upper + ROUNDING),
            "v": (-self.robot.velocity - ROUNDING, self.robot.velocity + ROUNDING),
            "torque": (np.full(self._shape[1], -np.inf), np.full(self._shape[1], np.inf)),
        }
        self._points = len(contact_names(self.runs[0].scene))
        self._width = 3 * self._shape[1] + 15 + 4 * self._points
        self._last = np.zeros((len(self.runs), self._width))
        self._select()

    def _select(self) -> None:
        """Find the runs that go on."""
        self._going = [k for k, run in enumerate(self.runs) if run.good]
        self._rollouts = [self.runs[k].rollout for k in self._going]

    @property
    def alive(self) -> bool:
        """Whether any run has not diverged."""
        return bool(self._going)

    def advance(self, until: float) -> None:
        """Advance all that have not diverged to a time [s]."""
        from hexapod_pin import native as _native

        try:
            good = _native.advance_together(self._rollouts, until, self.threads)
        except BaseException:  # Ctrl-C
            self.time = max(run.time for run in self.runs)
            raise
        self.time = until
        if not all(good):
            for k, still in zip(self._going, good, strict=True):
                self.runs[k].good = still
            self._select()

    def measure(self) -> Measurement:
        """Return what ideal sensors read now, with a leading axis of length B."""
        from hexapod_pin import native as _native

        rows = np.empty((len(self._rollouts), self._width))
        _native.read_together(self._rollouts, rows)
        if len(rows) < len(self.runs):
            self._last[self._going] = rows
            rows = self._last.copy()
        else:
            self._last = rows.copy()
        n, batch, points = self._shape[1], len(self.runs), self._points
        force = rows[:, 3 * n + 15 : 3 * n + 15 + 3 * points].reshape(batch, points, 3)
        return Measurement(
            time=self.time,
            q=rows[:, :n],
            v=rows[:, n : 2 * n],
            torque=rows[:, 2 * n : 3 * n],
            rotation=rows[:, 3 * n : 3 * n + 9].reshape(batch, 3, 3),
            angular_velocity=rows[:, 3 * n + 9 : 3 * n + 12],
            acceleration=rows[:, 3 * n + 12 : 3 * n + 15],
            foot_force=force[:, : self._feet],
            loaded=rows[:, self._width - points : self._width - points + self._feet] != 0.0,
        )

    def command(
        self, command: Command, period: float, call: str = "command", time: float | None = None
    ) -> None:
        """Give the drives new set-points.

        Args:
            command: checked here, but for its `ramp`.
            period: time after which one that ramps arrives [s].
            call: what has given it, for messages.
            time: when [s]; None: now.

        Raises:
            ParameterError: no numbers, a wrong shape, not finite, or beyond a joint's range or its
                largest rate.
        """
        by = (call, self.time if time is None else time)
        from hexapod_pin import native as _native

        arrival = self.time + period if command.ramp else -np.inf
        q = self._rows(by, "q", command.q)
        v, torque = (
            NO_ROWS if given is None else self._rows(by, name, given)
            for name, given in (("v", command.v), ("torque", command.torque))
        )
        _native.command_together(self._rollouts, q, v, torque, arrival)

    def _rows(self, by: tuple[str, float], name: str, given: Any) -> Array:
        """Return the checked set-points of the runs that go on."""
        from hexapod_pin import native as _native

        try:
            found = np.asarray(given)
        except (TypeError, ValueError, OverflowError):  # rows of several lengths
            found = np.asarray(None)
        if found.dtype.kind not in "biuf":
            allowed = f"real numbers [{UNITS[name]}], all rows of one length"
            told = f"an array of {found.dtype}" if isinstance(given, np.ndarray) else given
            raise ParameterError(f"{called_at(*by)}: {name}", told, allowed)
        rows = np.ascontiguousarray(found, dtype=float)
        if rows.shape != self._shape:
            allowed = f"of shape {self._shape}: runs, joints of the robot"
            raise ParameterError(f"{called_at(*by)}: {name}", rows.shape, allowed)
        if len(self._going) < len(self.runs):
            rows = rows[self._going]
        bad = _native.first_outside(rows, *self._limits[name])
        if bad >= 0:
            raise self._refusal(by, name, rows, *divmod(bad, self._shape[1]))
        return rows

    def _refusal(
        self, by: tuple[str, float], name: str, rows: Array, row: int, joint: int
    ) -> ParameterError:
        """Return the error that names a set-point that is not good."""
        lower, upper = (limit[joint] for limit in self._limits[name])
        return ParameterError(
            f"{called_at(*by)}: {name} of {self.robot.joint_names[joint]}",
            float(rows[row, joint]),
            f"finite, in {UNITS[name]}"
            if np.isinf(upper)
            else f"finite and from {lower:.4g} to {upper:.4g} {UNITS[name]}",
        )

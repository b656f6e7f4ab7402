"""Native runs at one time, side by side: what they read and what they are told, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.simulation.native_run import NativeRun

ROUNDING = 1e-9
"""How far a set-point may be beyond its range for rounding [rad, rad/s]."""

NO_ROWS = np.zeros((0, 0))


class LockStep:
    """B runs that are advanced, read and commanded together.

    A run that diverges drops out: its row of a measurement stays what it was, and what it is
    commanded does not matter.
    """

    def __init__(self, runs: Sequence[NativeRun]) -> None:
        """Take runs of one kind of robot; they stand at one time."""
        self.runs = list(runs)
        self.robot = self.runs[0].scene.robot
        self._feet = len(self.robot.feet)
        self._last: dict[str, Array] = {}

    @property
    def time(self) -> float:
        """Time of the runs [s]."""
        return max(run.time for run in self.runs)

    @property
    def alive(self) -> bool:
        """Whether any run has not diverged."""
        return any(run.good for run in self.runs)

    def advance(self, until: float) -> None:
        """Advance all that have not diverged to a time [s]."""
        from hexapod_pin import native as _native

        going = [run for run in self.runs if run.good]
        good = _native.advance_together([run.rollout for run in going], until)
        for run, still in zip(going, good, strict=True):
            run.good = still

    def measure(self) -> Measurement:
        """Return what ideal sensors read now, with a leading axis of length B."""
        from hexapod_pin import native as _native

        going = [k for k, run in enumerate(self.runs) if run.good]
        read = _native.read_together([self.runs[k].rollout for k in going]) if going else self._last
        if len(going) < len(self.runs) and going:
            read = {name: self._filled(name, rows, going) for name, rows in read.items()}
        self._last = read
        batch, feet = len(self.runs), self._feet
        return Measurement(
            time=self.time,
            q=read["q"],
            v=read["v"],
            torque=read["torque"],
            rotation=read["rotation"].reshape(batch, 3, 3),
            angular_velocity=read["angular_velocity"],
            acceleration=read["acceleration"],
            foot_force=read["foot_force"].reshape(batch, -1, 3)[:, :feet],
            loaded=read["loaded"][:, :feet] != 0.0,
        )

    def _filled(self, name: str, rows: Array, going: list[int]) -> Array:
        """Return the rows of all runs: those that are not going keep their last."""
        last = self._last.get(name)
        whole = np.zeros((len(self.runs), rows.shape[1])) if last is None else np.array(last)
        whole[going] = rows
        return whole

    def command(self, command: Command, period: float) -> None:
        """Give the drives new set-points; one that ramps arrives `period` [s] later.

        Raises:
            ParameterError: wrong shape, not finite, or beyond a joint's range or its largest rate.
        """
        from hexapod_pin import native as _native

        n, batch = len(self.robot.joint_names), len(self.runs)
        going = [k for k, run in enumerate(self.runs) if run.good]
        rows: dict[str, Any] = {}
        for name in ("q", "v", "torque"):
            given = getattr(command, name)
            rows[name] = NO_ROWS if given is None else _rows(name, given, (batch, n))[going]
        self._check(rows)
        arrival = self.time + period if command.ramp else -np.inf
        _native.command_together(
            [self.runs[k].rollout for k in going], rows["q"], rows["v"], rows["torque"], arrival
        )

    def _check(self, rows: dict[str, Array]) -> None:
        """Refuse set-points that are not finite or beyond a limit."""
        robot = self.robot
        bounds = {
            "q": (robot.lower, robot.upper, "rad"),
            "v": (-robot.velocity, robot.velocity, "rad/s"),
            "torque": (np.full(len(robot.lower), -np.inf), np.full(len(robot.lower), np.inf), "N m"),
        }
        for name, (lower, upper, unit) in bounds.items():
            if not rows[name].size:
                continue
            good = (rows[name] >= lower - ROUNDING) & (rows[name] <= upper + ROUNDING)
            good &= np.isfinite(rows[name])
            if good.all():
                continue
            row, joint = (int(k) for k in np.argwhere(~good)[0])
            allowed = f"finite, {lower[joint]:.4g} to {upper[joint]:.4g} {unit}"
            raise ParameterError(
                f"command at t = {self.time:g} s, {name}[{robot.joint_names[joint]}]",
                float(rows[name][row, joint]),
                allowed,
            )


def _rows(name: str, given: Any, shape: tuple[int, int]) -> Array:
    """Return an array of that shape, refusing another."""
    array = np.ascontiguousarray(given, dtype=float)
    if array.shape != shape:
        raise ParameterError(
            f"Command.{name}", array.shape, f"of shape {shape}: runs, joints of the robot"
        )
    return array

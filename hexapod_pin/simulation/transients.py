"""What a cycle of a walk misses its beginning by, and how far a repeating walk is still from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.results.schema import differences
from hexapod_pin.results.summary import Summary
from hexapod_pin.robot.rotations import trunk_vertical
from hexapod_pin.simulation.methods import DEFAULT_ACCURACY

if TYPE_CHECKING:
    from hexapod_pin.simulation.methods import MethodSettings
    from hexapod_pin.simulation.native_run import NativeRun

LEAST_RATIO, MOST_RATIO = 0.1, 0.9
"""Between these the contraction per cycle counts [-]: what two cycles show may be chance."""

TORQUE_SHARE = 0.01
"""Accuracy of torques where none is requested, as a share of the largest torque [-]."""


@dataclass(frozen=True)
class Change:
    """What a cycle misses its beginning by.

    Attributes:
        place: height of the trunk over the ground [m].
        turn: direction of the vertical, in the trunk's axes [rad].
        joint: any joint angle [rad].
        torque: any joint's torque [N m].
        foot_force: any foot's force [N].
    """

    place: float
    turn: float
    joint: float
    torque: float
    foot_force: float

    @classmethod
    def of(cls, run: NativeRun) -> Change:
        """Compare the first and the last sample of a run of one cycle."""
        samples = run.rollout.record()
        first, last = samples["q"][[0, -1]]
        torque, force = (samples[name][-1] - samples[name][0] for name in ("torque", "foot_force"))
        if "foot_force" not in run.omitted:  # its direction turns with the walk, its parts do not
            upright, level = np.split(_upright_and_level(samples["foot_force"][[0, -1]]), 2, axis=1)
            force = np.hypot(upright[1] - upright[0], level[1] - level[0])
        return cls(
            place=abs(height_over_ground(run, last) - height_over_ground(run, first)),
            turn=float(np.linalg.norm(trunk_vertical(last) - trunk_vertical(first))),
            joint=_largest(last[7:] - first[7:]),
            torque=_largest(torque),
            foot_force=_largest(force),
        )

    @property
    def position(self) -> float:
        """The largest of place, turn and joint [m and rad]."""
        return max(self.place, self.turn, self.joint)

    def contraction(self, before: Change) -> float:
        """Return the share of the change of the cycle before [-], within the limits that count."""
        pairs = ((self.position, before.position), (self.torque, before.torque))
        shares = [now / then for now, then in pairs if then > 0.0]
        return min(MOST_RATIO, max([LEAST_RATIO, *shares]))

    def scaled(self, factor: float) -> Change:
        """Return every part times a factor [-]."""
        return Change(**{name: factor * size for name, size in vars(self).items()})

    def added_to(self, error: ErrorEstimate) -> ErrorEstimate:
        """Return an error with this added to each of its samples."""
        return ErrorEstimate(**{n: values + getattr(self, n) for n, values in error.arrays.items()})


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def height_over_ground(run: NativeRun, q: Array) -> float:
    """Return the height of the trunk's origin over the ground [m]."""
    return float(q[2] - run.scene.terrain.surface().height_at(q[0], q[1]))


def _upright_and_level(force: Array) -> Array:
    """Return the vertical and the horizontal size of forces on feet (2, 3 F). Shape (2, 2 F)."""
    parts = force.reshape(2, -1, 3)
    return np.concatenate([parts[..., 2], np.linalg.norm(parts[..., :2], axis=2)], axis=1)


@dataclass(frozen=True)
class Transients:
    """What is left of the transients in a cycle, and how many cycles were run until then.

    Of a walk that contracts to the share r per cycle, a cycle that misses its beginning by d is off
    by at most d/(1 - r); its numbers, which differ by d from those of the cycle before, by at most
    d r/(1 - r).

    Attributes:
        cycles: run so far [-].
        left: in the state, in torques and forces.
        numbers: in the summary's numbers, by name.
    """

    cycles: int
    left: Change
    numbers: Mapping[str, Array]

    @classmethod
    def of(
        cls,
        cycles: int,
        changes: tuple[Change, Change],
        numbers: tuple[Mapping[str, Any], ...] | None,
    ) -> Transients:
        """Return what is left in the second of two cycles, and in their numbers if given."""
        ratio = changes[1].contraction(changes[0])
        most = {}
        if numbers is not None:
            missed = differences(Summary, numbers[1], numbers[0], ratio / (1.0 - ratio))
            # Of one joint or foot two cycles may agree by chance: the largest counts for all.
            most = {name: np.full_like(x, np.max(x, initial=0.0)) for name, x in missed.items()}
        return cls(cycles, changes[1].scaled(1.0 / (1.0 - ratio)), most)

    def share(self, method: MethodSettings, largest_torque: float) -> float:
        """Return how much of the accuracy requested they are [-]."""
        torque = method.torque_accuracy or (method.torque_share or TORQUE_SHARE) * largest_torque
        return max(
            self.left.position / (method.accuracy or DEFAULT_ACCURACY),
            self.left.torque / torque if torque else 0.0,
        )

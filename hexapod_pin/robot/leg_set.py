"""Inverse kinematics of several legs at once, all targets of all legs in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.leg_geometry import (
    ANGLE_TOLERANCE,
    BRANCHES,
    POSITION_TOLERANCE,
    YawPitchPitch,
    closed_form_determinant,
    closed_form_rates,
    joint_rates,
    normalised_determinant,
)
from hexapod_pin.robot.leg_kinematics import (
    LegKinematics,
    continuous,
    nearest_branch,
    reach_tolerance,
)
from hexapod_pin.robot.serial_chain import SerialChain


@dataclass(frozen=True, eq=False)
class LegSet:
    """L legs with their geometry stacked; paths start near the standing posture.

    Attributes:
        legs: the legs one by one.
        chain: their stacked joint axes.
        posture: joint angles of the standing posture [rad]. Shape (L, J).
        neutral_feet: foot centres of that posture, base frame [m]. Shape (L, 3).
        closed_form: stacked closed form on the branch of the posture; None if any leg has none.
        task: directions that legs of two joints follow, as of `LegGeometry`; None: all three.
            Shape (L, 1, 2, 3).
    """

    legs: tuple[LegKinematics, ...]
    chain: SerialChain
    posture: Array
    neutral_feet: Array
    closed_form: StackedClosedForm | None
    task: Array | None = None

    @staticmethod
    def of(legs: Sequence[LegKinematics]) -> LegSet:
        """Stack legs that have the same number of joints."""
        tasks = [leg.task for leg in legs if leg.task is not None]
        feet = np.stack([leg.forward(leg.posture) for leg in legs])
        return LegSet(
            legs=tuple(legs),
            chain=SerialChain.stack([leg.chain for leg in legs]),
            posture=np.stack([leg.posture for leg in legs]),
            neutral_feet=read_only(feet),
            closed_form=StackedClosedForm.of(legs, feet),
            task=np.stack(tasks)[:, None] if tasks else None,
        )

    def jacobian(self, q: Array) -> Array:
        """Return d p_BF / d q of joint angles (L, N, J), a column per joint [m/rad].

        Returns:
            Shape (L, N, 3, J).
        """
        return self.chain.jacobian(q)

    def rates(self, v_BF: Array, q: Array) -> Array:
        """Return the joint rates that move the feet.

        Args:
            v_BF: foot velocities in base axes [m/s]. Shape (L, N, 3).
            q: joint angles [rad]. Shape (L, N, J).

        Returns:
            Shape (L, N, J).
        """
        return joint_rates(self.jacobian(q), v_BF, self.task)

    def normalised_determinant(self, q: Array) -> Array:
        """Return how far from singular postures (L, N, J) are; see `leg_geometry`. (L, N)."""
        if self.closed_form is None:
            return normalised_determinant(self.jacobian(q), self.task)
        return closed_form_determinant(self.closed_form.geometry, q)

    def estimated_rates(self, p_BF: Array, v_BF: Array, q: Array) -> Array:
        """Return joint rates, quickly, but not to the last bit of `joint_rates` [rad/s].

        Args:
            p_BF: foot positions in the base frame [m]. Shape (L, N, 3).
            v_BF: foot velocities in base axes [m/s]. Shape (L, N, 3).
            q: joint angles from `inverse` [rad]. Shape (L, N, J).

        Returns:
            Shape (L, N, J).
        """
        form = self.closed_form
        if form is None:
            return self.rates(v_BF, q)
        return closed_form_rates(form.geometry, form.fold, p_BF, v_BF, q)

    def inverse(self, p_BF: Array, near: Array | None = None) -> Array:
        """Return joint angles along paths of foot targets, on the branch of the standing posture.

        Args:
            p_BF: foot targets in the base frame [m]. Shape (L, N, 3).
            near: reference for the first angles, the standing posture if None [rad]. (L, J).

        Returns:
            Joint angles, continuous along each path [rad]. Shape (L, N, J).

        Raises:
            ReachError: of the first leg that cannot follow its path inside its joint limits.
        """
        q, refused = self.solve(p_BF, near)
        if refused is not None:
            raise refused[1]
        return q

    def unlimited(self, p_BF: Array) -> Array:
        """Return joint angles as `inverse`, joint limits aside.

        In closed form nothing is refused: a target out of reach gives the straight or folded leg
        in its direction. Legs of another shape raise ReachError.
        """
        if self.closed_form is None:
            return np.stack(
                [leg.inverse(p, limits=False) for leg, p in zip(self.legs, p_BF, strict=True)]
            )
        return self.closed_form.angles(p_BF)

    def solve(
        self, p_BF: Array, near: Array | None = None
    ) -> tuple[Array, tuple[int, ReachError] | None]:
        """Return joint angles as `inverse`, and the first leg that cannot follow, with its error.

        The angles of that leg and of those after it are not to be used.
        """
        start = self.posture if near is None else near
        if self.closed_form is None or not np.isfinite(p_BF).all():
            empty = np.zeros((*p_BF.shape[:-1], self.posture.shape[1]))
            return self._one_by_one(empty, p_BF, start, range(len(self.legs)))
        q, failed = self.closed_form.solve(p_BF, start)
        return self._one_by_one(q, p_BF, start, np.flatnonzero(failed))

    def inverse_each(self, p_BF: Array, near: Array) -> Array:
        """Return joint angles of targets that have nothing to do with each other.

        Args:
            p_BF: foot targets in the base frame [m]. Shape (L, N, 3).
            near: angles to be nearest to, by whole turns [rad]. Shape (L, N, J).

        Returns:
            Joint angles on the branch of the standing posture [rad]. Shape (L, N, J).

        Raises:
            ReachError: of the first leg that cannot reach a target inside its joint limits.
        """
        if self.closed_form is not None and np.isfinite(p_BF).all():
            q, failed = self.closed_form.solve_each(p_BF, near)
            if not failed.any():
                return q
        return np.stack(
            [
                leg.inverse_each(targets, starts)
                for leg, targets, starts in zip(self.legs, p_BF, near, strict=True)
            ]
        )

    def _one_by_one(
        self, q: Array, p_BF: Array, near: Array, indices: Iterable[int]
    ) -> tuple[Array, tuple[int, ReachError] | None]:
        """Solve some legs by their own inverse kinematics, which knows what to refuse."""
        for index in indices:
            try:
                q[index] = self.legs[index].inverse(p_BF[index], near=near[index])
            except ReachError as error:
                return q, (int(index), error)
        return q, None


@dataclass(frozen=True, eq=False)
class StackedClosedForm:
    """Closed form of L legs, each on the branch of its standing posture.

    Attributes:
        geometry: stacked geometry.
        fold: -1 for a leg folded over its yaw axis, else 1. Shape (L, 1).
        knee: 1 with the knee up, -1 with the knee down. Shape (L, 1).
        tolerance: rounding of the reach [m]. Shape (L, 1).
        lower: lower joint limits less their tolerance [rad]. Shape (L, 1, 3).
        upper: upper joint limits and their tolerance [rad]. Shape (L, 1, 3).
    """

    geometry: YawPitchPitch
    fold: Array
    knee: Array
    tolerance: Array
    lower: Array
    upper: Array

    @staticmethod
    def of(legs: Sequence[LegKinematics], feet: Array) -> StackedClosedForm | None:
        """Stack the closed forms of legs with standing feet (L, 3) [m]; None if any has none."""
        forms = [leg.closed_form for leg in legs if leg.closed_form is not None]
        if len(forms) < len(legs):
            return None
        geometry = YawPitchPitch.stack(forms)
        posture, lower, upper = (
            np.stack([getattr(leg, name) for leg in legs]) for name in ("posture", "lower", "upper")
        )
        nearest = nearest_branch(geometry, feet[:, None], posture, lower, upper)
        branches = np.array(BRANCHES, dtype=np.float64)[nearest]
        return StackedClosedForm(
            geometry=geometry,
            fold=branches[:, :1],
            knee=branches[:, 1:],
            tolerance=reach_tolerance(geometry),
            lower=lower[:, None] - ANGLE_TOLERANCE,
            upper=upper[:, None] + ANGLE_TOLERANCE,
        )

    def row_solver(self, joints: NDArray[np.intp]) -> Callable[[Array, Array], bool]:
        """Return `solve_each` of the core, for control at ticks, on rows of joint angles.

        Args:
            joints: places of the legs' joints in a row. Shape (L, 3).

        Returns:
            A function of feet (B, L, 3) [m] and rows (B, n) [rad], contiguous: the legs' angles
            replace those in the rows, by whole turns nearest to them. False where a leg cannot:
            the rows are not to be used.
        """
        from hexapod_pin.native import LegsInverse

        legs, geometry = LegsInverse(), self.geometry
        for k, (first, second, third) in enumerate(joints.tolist()):
            p_BH, lengths, sign, offset = (
                row[k, 0]
                for row in (geometry.p_BH, geometry.lengths, geometry.sign, geometry.offset)
            )
            fold, knee, tolerance = (
                float(row[k, 0]) for row in (self.fold, self.knee, self.tolerance)
            )
            legs.add(
                geometry.r_BH[k], p_BH, lengths, sign, offset, fold, knee, tolerance,
                self.lower[k, 0], self.upper[k, 0], [first, second, third],
            )  # fmt: skip
        return legs.solve

    def angles(self, p_BF: Array) -> Array:
        """Return joint angles (L, N, 3) [rad] without any check, whole turns left as they are."""
        return self.geometry.solve(*self.geometry.to_hip(p_BF), self.fold, self.knee)[0]

    def solve(self, p_BF: Array, near: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return joint angles (L, N, 3) [rad] and which legs cannot follow their paths (L,).

        Args:
            p_BF: foot targets in the base frame [m]. Shape (L, N, 3).
            near: reference for the first angles [rad]. Shape (L, 3).
        """
        q, radius, outside = self._angles(p_BF)
        return self._checked(continuous(q, near), radius, outside)

    def solve_each(self, p_BF: Array, near: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the same of unrelated targets, near angles (L, N, 3) by whole turns [rad]."""
        q, radius, outside = self._angles(p_BF)
        turns = np.rint((near - q) / (2.0 * np.pi))
        return self._checked(q + 2.0 * np.pi * turns if turns.any() else q, radius, outside)

    def _angles(self, p_BF: Array) -> tuple[Array, Array, Array]:
        """Return angles, distance from the yaw axes [m] and distance outside the reach [m]."""
        p_HF, radius = self.geometry.to_hip(p_BF)
        q, outside = self.geometry.solve(p_HF, radius, self.fold, self.knee)
        return q, radius, outside

    def _checked(self, q: Array, radius: Array, outside: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the angles, and which legs have one that is not to be used."""
        missed = (radius < POSITION_TOLERANCE) | (outside > self.tolerance)
        beyond = (q < self.lower) | (q > self.upper)
        return q, np.logical_or(missed.any(axis=1), beyond.any(axis=(1, 2)))

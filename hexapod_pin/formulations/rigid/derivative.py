"""Grounded feet stick to rigid ground (S2 appendix eqs. 1-4), within their friction cones.

    M a + h = S^T tau + J^T lambda      (1), (2)
    J a + J' v = 0                      (3)
    [M  J^T; J  0] [a; -lambda] = [S^T tau - h; -J' v]    (4), as printed

lambda are the ground forces on the feet. Where the rows of J depend on each other the motion is
still unique, but lambda is not: the share of smallest norm is given and marked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.model import EquationTerms, RigidModel
from hexapod_pin.formulations.truncated_svd import truncated_svd

if TYPE_CHECKING:
    from hexapod_pin.robot.state import State


# S2 appendix eq. 3: which feet the ground constrains, and the rows J that constrain them.


@dataclass(frozen=True)
class ContactSet:
    """The feet in contact, by index: k that stick have three rows each, l that slide have one.

    Attributes:
        sticking: feet that do not move at all.
        sliding: feet that slide without friction: constrained along the normal only.
    """

    sticking: tuple[int, ...]
    sliding: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check that no foot is constrained twice.

        Raises:
            ParameterError: one is.
        """
        if len(set(self.feet)) != len(self.feet):
            raise ParameterError("feet", self.feet, "each given once")

    @property
    def feet(self) -> tuple[int, ...]:
        """All of them, in the order of their rows."""
        return (*self.sticking, *self.sliding)

    def rows(self, all_rows: Array, normal: Array) -> Array:
        """Return J (3k + l, nv) of these feet from the rows of all feet (F, 3, nv)."""
        size = all_rows.shape[2]
        full = all_rows[list(self.sticking)].reshape(-1, size)
        single = np.einsum("i,fij->fj", normal, all_rows[list(self.sliding)])
        return np.vstack([full, single])

    def equations(self, terms: EquationTerms, normal: Array) -> tuple[Array, Array]:
        """Return J (3k + l, nv) and J' v (3k + l,) of eq. 3, J a + J' v = 0."""
        full = terms.drift[list(self.sticking)].ravel()
        single = terms.drift[list(self.sliding)] @ normal
        return self.rows(terms.rows, normal), np.concatenate([full, single])

    def forces(self, multipliers: Array, normal: Array, count: int) -> Array:
        """Return multipliers (3k + l,) as forces on all `count` feet. Shape (F, 3)."""
        force, cut = np.zeros((count, 3)), 3 * len(self.sticking)
        force[list(self.sticking)] = multipliers[:cut].reshape(-1, 3)
        force[list(self.sliding)] = multipliers[cut:, None] * normal
        return force

    def force_flags(self, flags: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
        """Return flags of the multipliers for all `count` feet, True elsewhere. Shape (F, 3)."""
        found, cut = np.ones((count, 3), dtype=bool), 3 * len(self.sticking)
        found[list(self.sticking)] = flags[:cut].reshape(-1, 3)
        found[list(self.sliding)] = flags[cut:, None]
        return found


# The saddle-point (KKT) system of S2 appendix eqs. 4 and 5, for rows J of any rank.

RELATIVE_RANK_TOLERANCE = 1e-9
"""Singular values of L^-1 J^T below this share of the largest count as zero [-]."""

FULL_RANK_PIVOT_RATIO = 1e-6
"""Last pivot over the first above which pivoted QR alone settles that the rank is full [-]."""

UNIQUE_NULL_SPACE_PART = 1e-7
"""A multiplier with a larger part than this in the null space is not unique [-]."""


@dataclass(frozen=True)
class KktSolution:
    """Solution of [M -J^T; J 0] [x; f] = [r; t] with m rows.

    Attributes:
        x: acceleration or velocity change. Shape (n,). Unique, whatever the rank.
        f: the multipliers of smallest norm. Shape (m,).
        rank: of J.
        unique: which multipliers every solution shares. Shape (m,).
        residual: J x - t; not 0 where the rows contradict each other, then of least norm. (m,).
    """

    x: Array
    f: Array
    rank: int
    unique: NDArray[np.bool_]
    residual: Array


def solve_kkt(mass: Array, right: Array, rows: Array, target: Array) -> KktSolution:
    """Solve [M -J^T; J 0] [x; f] = [r; t] by QR or SVD of A = L^-1 J^T, M = L L^T.

    The motion of the system does not depend on how redundant rows share their load; f is the
    share of smallest norm. Rows that cannot all be met are met in the least-squares sense.
    QR with pivoting serves rows that are clearly independent, SVD all others.

    Args:
        mass: M, positive definite. Shape (n, n).
        right: r. Shape (n,).
        rows: J. Shape (m, n).
        target: t. Shape (m,).
    """
    from scipy.linalg import qr

    inverse_root = np.linalg.inv(np.linalg.cholesky(mass))  # L^-1
    a, free, count = inverse_root @ rows.T, inverse_root @ right, len(rows)
    needed = target - a.T @ free
    if 0 < count <= len(mass):
        base, upper, order = qr(a, mode="economic", pivoting=True)
        pivots = np.abs(np.diag(upper))
        if pivots[-1] > FULL_RANK_PIVOT_RATIO * pivots[0]:
            part = np.linalg.solve(upper.T, needed[order])
            f = np.empty(count)
            f[order] = np.linalg.solve(upper, part)
            x = inverse_root.T @ (free + base @ part)
            return KktSolution(x, f, count, np.ones(count, dtype=bool), rows @ x - target)
    left, size, across, null = truncated_svd(a, RELATIVE_RANK_TOLERANCE)
    part = across @ needed / size
    x = inverse_root.T @ (free + left @ part)
    unique = np.asarray(np.linalg.norm(null, axis=1) < UNIQUE_NULL_SPACE_PART)
    return KktSolution(x, across.T @ (part / size), len(size), unique, rows @ x - target)


# The sticking assumption of S2 appendix eqs. 3-5: each foot's force against its friction cone.

ROUNDING_SHARE = 1e-9
"""Forces below this share of the largest count as zero [-]."""


@dataclass(frozen=True)
class StickingCheck:
    """The sticking assumption for one grounded foot.

    Attributes:
        foot: its name.
        normal: force (or impulse) along the ground's normal [N or N s]; negative pulls.
        tangential: size of the rest [N or N s].
        verdict: "sticks", "pulls" (the ground would have to hold it down) or "slides" (outside
            the friction cone).
        unique: whether all three components are determined; else they are one choice of many.
    """

    foot: str
    normal: float
    tangential: float
    verdict: str
    unique: bool

    @property
    def holds(self) -> bool:
        """Whether the assumption held."""
        return self.verdict == "sticks"

    @property
    def ratio(self) -> float:
        """Coefficient of friction it needs [-]; infinite where it is not pressed on."""
        if self.tangential == 0.0:
            return 0.0
        return self.tangential / self.normal if self.normal > 0.0 else float("inf")


def check_sticking(
    model: RigidModel, feet: Sequence[int], force: Array, unique: NDArray[np.bool_]
) -> tuple[StickingCheck, ...]:
    """Return one check per foot on the ground.

    Args:
        model: the robot and its ground.
        feet: indices of the feet on the ground.
        force: forces or impulses on all feet, world axes. Shape (F, 3).
        unique: which of their components are determined. Shape (F, 3).
    """
    names, small = model.foot_names, ROUNDING_SHARE * float(np.abs(force).max(initial=0.0))
    checks = []
    for k in feet:
        normal = float(force[k] @ model.normal)
        tangential = float(np.linalg.norm(force[k] - normal * model.normal))
        verdict = "sticks"
        if normal < -small:
            verdict = "pulls"
        elif tangential > model.ground.mu * max(normal, 0.0) + small:
            verdict = "slides"
        checks.append(StickingCheck(names[k], normal, tangential, verdict, bool(unique[k].all())))
    return tuple(checks)


# S2 appendix eqs. 1-4: a robot whose grounded feet stick to rigid ground.

BASE = slice(0, 6)
JOINTS = slice(6, None)


@dataclass(frozen=True)
class RigidDerivative:
    """v' and the forces of rigid contact at one state; F feet, k of them grounded, n joints.

    Attributes:
        acceleration: v' of the base (body axes) and the joints [m/s^2, rad/s^2]. Shape (nv,).
        force: lambda, of the ground on all feet, world axes [N]. Shape (F, 3).
        torque: of the servos [N m]. Shape (n,).
        unique: which force components are determined. Shape (F, 3).
        rank: of the 3k rows of the grounded feet.
        residual: acceleration left at the contact points, row by row [m/s^2]. Shape (3k,).
        checks: the sticking assumption, foot by foot.
        split: how forces that are not unique were chosen.
    """

    acceleration: Array
    force: Array
    torque: Array
    unique: NDArray[np.bool_]
    rank: int
    residual: Array
    checks: tuple[StickingCheck, ...]
    split: str = "minimum norm"

    @property
    def sticks(self) -> bool:
        """Whether every grounded foot could stick."""
        return all(check.holds for check in self.checks)


def derivative(
    model: RigidModel, state: State, torque: ArrayLike, feet: Sequence[int]
) -> RigidDerivative:
    """Return accelerations and ground forces under given servo torques, eqs. 1-4.

    Args:
        model: robot and ground.
        state: the state.
        torque: of the servos [N m]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the torques do not fit the joints, or a foot is named twice.
    """
    terms = model.terms(state.q, state.v)
    return constrained_derivative(model, terms, torque, ContactSet(tuple(feet)))


def constrained_derivative(
    model: RigidModel, terms: EquationTerms, torque: ArrayLike, contacts: ContactSet
) -> RigidDerivative:
    """Return the same from terms at hand, for feet that stick and feet that slide."""
    tau = _joint_values(model, torque)
    rows, drift = contacts.equations(terms, model.normal)
    right = -terms.bias
    right[JOINTS] += tau
    found = solve_kkt(terms.mass, right, rows, -drift)
    return _solution(model, found, found.x, tau, contacts)


def prescribed_derivative(
    model: RigidModel, state: State, joint_acceleration: ArrayLike, feet: Sequence[int]
) -> RigidDerivative:
    """Return base acceleration, ground forces and torques where the joints' motion is prescribed.

    The base has six accelerations and k feet 3k rows: with more than two feet the rows must agree
    (footholds that stand still), else they are met in the least-squares sense and `residual` is
    what is left; and the 3k forces are not unique.

    Args:
        model: robot and ground.
        state: the state.
        joint_acceleration: prescribed [rad/s^2]. Shape (n,).
        feet: indices of the grounded feet.

    Raises:
        ParameterError: the accelerations do not fit the joints, or a foot is named twice.
    """
    contacts, terms = ContactSet(tuple(feet)), model.terms(state.q, state.v)
    joints = _joint_values(model, joint_acceleration)
    rows, drift = contacts.equations(terms, model.normal)
    right = -terms.bias[BASE] - terms.mass[BASE, JOINTS] @ joints
    target = -drift - rows[:, JOINTS] @ joints
    found = solve_kkt(terms.mass[BASE, BASE], right, rows[:, BASE], target)
    acceleration = np.concatenate([found.x, joints])
    tau = terms.mass[JOINTS] @ acceleration + terms.bias[JOINTS] - rows[:, JOINTS].T @ found.f
    return _solution(model, found, acceleration, tau, contacts)


def _solution(
    model: RigidModel, found: KktSolution, acceleration: Array, tau: Array, contacts: ContactSet
) -> RigidDerivative:
    count = len(model.robot.feet)
    force = contacts.forces(found.f, model.normal, count)
    unique = contacts.force_flags(found.unique, count)
    checks = check_sticking(model, contacts.feet, force, unique)
    return RigidDerivative(acceleration, force, tau, unique, found.rank, found.residual, checks)


def _joint_values(model: RigidModel, values: ArrayLike) -> Array:
    joints = np.asarray(values, dtype=float)
    if joints.shape != (model.model.nv - 6,):
        raise ParameterError("joint values", joints.shape, f"of shape ({model.model.nv - 6},)")
    return joints

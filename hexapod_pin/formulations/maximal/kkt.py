"""S1 eq. 1, M v' = f + D' lambda and D v' = g, on a tree of bodies: leaves to root and back.

A leaf j on body i leaves S = D_j M_j^-1 D_j' (5 x 5) and from its own two equations

    lambda = S^-1 (g - D_i v'_i - D_j M_j^-1 f_j),

which adds D_i' S^-1 D_i to M_i (6 x 6) and D_i' S^-1 (g - D_j M_j^-1 f_j) to f_i. Joints of equal
depth are done together, so six equal legs cost three batches. Nothing larger than 6 x 6 is solved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.constraints import ROWS_PER_JOINT

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.constraints import ConstraintEquations


class TreeElimination:
    """Block elimination in the order of one tree."""

    def __init__(self, bodies: Bodies) -> None:
        """Keep the tree."""
        self._parent = bodies.parent
        self._levels = bodies.levels
        self._joints_on_body = bodies.joints_on_body

    def solve_kkt(
        self, mass: Array, force: Array, d: ConstraintEquations, target: Array, root_target: Array
    ) -> tuple[Array, Array, Array]:
        """Solve for accelerations and multipliers.

        Args:
            mass: mass matrices of the bodies, world axes. Shape (nb, 6, 6).
            force: f. Shape (nb, 6).
            d: the blocks of D.
            target: g of the joints. Shape (nj, 5).
            root_target: g of the root's constraints. Shape (h,).

        Returns:
            v' (nb, 6), lambda of the joints (nj, 5) and of the root (h,).
        """
        mass, force = mass.copy(), force.copy()
        kept: list[tuple[Array, Array]] = []
        for level in self._levels[::-1]:
            free, reply = _eliminate(level, mass, force, d, target)
            share = np.matmul(d.on_parent[level].transpose(0, 2, 1), reply)
            total = self._joints_on_body[:, level] @ share.reshape(len(share), -1)
            mass += total.reshape(-1, 6, 7)[:, :, :6]
            force += total.reshape(-1, 6, 7)[:, :, 6]
            kept.append((free, reply))
        rates, multipliers = np.empty_like(force), np.empty_like(target)
        rates[0], support = _solve_root(mass[0], force[0], d.root.rows, root_target)
        for level, (free, reply) in zip(self._levels, kept[::-1], strict=True):
            above = rates[self._parent[level]][:, :, None]
            found = reply[:, :, 6:] - np.matmul(reply[:, :, :6], above)
            multipliers[level] = found[:, :, 0]
            below = free[:, :, ROWS_PER_JOINT:] + np.matmul(free[:, :, :ROWS_PER_JOINT], found)
            rates[level.start + 1 : level.stop + 1] = below[:, :, 0]
        return rates, multipliers, support


def _eliminate(
    level: slice, mass: Array, force: Array, d: ConstraintEquations, target: Array
) -> tuple[Array, Array]:
    """Return M_j^-1 [D_j' f_j] (n, 6, 6) and S^-1 [D_i, g - D_j M_j^-1 f_j] (n, 5, 7)."""
    child = slice(level.start + 1, level.stop + 1)
    rows = d.on_child[level]
    right = np.concatenate([rows.transpose(0, 2, 1), force[child][:, :, None]], axis=2)
    free = np.linalg.solve(mass[child], right)
    answer = np.matmul(rows, free)
    rest = target[level][:, :, None] - answer[:, :, ROWS_PER_JOINT:]
    wide = np.concatenate([d.on_parent[level], rest], axis=2)
    reply = np.linalg.solve(answer[:, :, :ROWS_PER_JOINT], wide)
    return np.asarray(free), np.asarray(reply)


def _solve_root(mass: Array, force: Array, rows: Array, target: Array) -> tuple[Array, Array]:
    """Return the root's acceleration (6,) and the multipliers (h,) of its constraints."""
    if not len(rows):
        return np.asarray(np.linalg.solve(mass, force)), np.empty(0)
    free = np.linalg.solve(mass, np.column_stack([force, rows.T]))
    rate, across = free[:, 0], free[:, 1:]
    support = np.linalg.solve(rows @ across, target - rows @ rate)
    return np.asarray(rate + across @ support), np.asarray(support)

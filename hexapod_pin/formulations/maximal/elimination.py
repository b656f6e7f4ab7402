"""M v' = f + D' lambda, D v' = g on a tree of bodies, from the leaves to the root and back.

A leaf j on body i leaves S = D_j M_j^-1 D_j' (5 x 5) and from its own two equations

    lambda = S^-1 (g - D_i v'_i - D_j M_j^-1 f_j),

which adds D_i' S^-1 D_i to M_i (6 x 6) and D_i' S^-1 (g - D_j M_j^-1 f_j) to f_i. Joints of equal
depth are done together, so six equal legs cost three batches. Nothing larger than 6 x 6 is solved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.constraints import ROWS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies

    Parents = slice | NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Rows:
    """The blocks of D.

    Attributes:
        on_parent: (nj, 5, 6) columns of the joints' parents.
        on_child: (nj, 5, 6) columns of their children.
        mount: (h, 6) of the root in the world, h = 0, 3 or 6.
    """

    on_parent: Array
    on_child: Array
    mount: Array


class Elimination:
    """The order of elimination of one tree."""

    def __init__(self, bodies: Bodies) -> None:
        """Find which joints are done together."""
        self._parent = bodies.parent
        self._levels = bodies.levels
        self._gather = [_carriers(bodies, level) for level in bodies.levels]

    def __call__(
        self, mass: Array, force: Array, rows: Rows, wanted: Array, hold: Array
    ) -> tuple[Array, Array, Array]:
        """Solve for accelerations and multipliers.

        Args:
            mass: (nb, 6, 6) mass matrices of the bodies, world axes.
            force: (nb, 6) f.
            rows: D.
            wanted: (nj, 5) g of the joints.
            hold: (h,) g of the root's mount.

        Returns:
            v' (nb, 6), lambda of the joints (nj, 5) and of the mount (h,).
        """
        mass, force = mass.copy(), force.copy()
        kept: list[tuple[Array, Array]] = []
        for level, (parents, sums) in zip(self._levels[::-1], self._gather[::-1], strict=True):
            free, reply = _leave(level, mass, force, rows, wanted)
            share = np.matmul(rows.on_parent[level].transpose(0, 2, 1), reply)
            total = share if sums is None else _summed(sums, share)
            mass[parents] += total[:, :, :6]
            force[parents] += total[:, :, 6]
            kept.append((free, reply))
        rates = np.empty_like(force)
        rates[0], support = _held(mass[0], force[0], rows.mount, hold)
        multipliers = np.empty_like(wanted)
        for level, (free, reply) in zip(self._levels, kept[::-1], strict=True):
            above = rates[self._parent[level]][:, :, None]
            found = reply[:, :, 6:] - np.matmul(reply[:, :, :6], above)
            multipliers[level] = found[:, :, 0]
            below = free[:, :, ROWS:] + np.matmul(free[:, :, :ROWS], found)
            rates[level.start + 1 : level.stop + 1] = below[:, :, 0]
        return rates, multipliers, support


def _leave(
    level: slice, mass: Array, force: Array, rows: Rows, wanted: Array
) -> tuple[Array, Array]:
    """Return M_j^-1 [D_j' f_j] (n, 6, 6) and S^-1 [D_i, g - D_j M_j^-1 f_j] (n, 5, 7)."""
    child = slice(level.start + 1, level.stop + 1)
    across = rows.on_child[level]
    right = np.concatenate([across.transpose(0, 2, 1), force[child][:, :, None]], axis=2)
    free = np.linalg.solve(mass[child], right)
    answer = np.matmul(across, free)
    rest = wanted[level][:, :, None] - answer[:, :, ROWS:]
    wide = np.concatenate([rows.on_parent[level], rest], axis=2)
    reply = np.linalg.solve(answer[:, :, :ROWS], wide)
    return np.asarray(free), np.asarray(reply)


def _held(mass: Array, force: Array, mount: Array, hold: Array) -> tuple[Array, Array]:
    """Return the root's acceleration (6,) and the multipliers (h,) of its mount."""
    if not len(mount):
        return np.asarray(np.linalg.solve(mass, force)), np.empty(0)
    free = np.linalg.solve(mass, np.column_stack([force, mount.T]))
    rate, across = free[:, 0], free[:, 1:]
    support = np.linalg.solve(mount @ across, hold - mount @ rate)
    return np.asarray(rate + across @ support), np.asarray(support)


def _carriers(bodies: Bodies, level: slice) -> tuple[Parents, Array | None]:
    """Return the parents of a level, each once, and what sums joints over them.

    The sums are a 0-1 matrix, or None where every parent carries one joint.
    """
    parents, which = np.unique(bodies.parent[level], return_inverse=True)
    row = slice(int(parents[0]), int(parents[-1]) + 1)
    found: Parents = row if row.stop - row.start == len(parents) else parents
    if np.array_equal(which, np.arange(len(parents))):
        return found, None
    sums = np.zeros((len(parents), len(which)))
    sums[which, np.arange(len(which))] = 1.0
    return found, sums


def _summed(sums: Array, share: Array) -> Array:
    """Return the shares (n, 6, 7) of a level's joints added up over their parents."""
    flat = sums @ share.reshape(len(share), -1)
    return flat.reshape(-1, *share.shape[1:])

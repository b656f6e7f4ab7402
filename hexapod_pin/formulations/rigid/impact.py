"""S2 appendix eq. 5: plastic impact of feet with rigid ground.

    [M -J^T; J 0] [dv; I] = [0; -J v-],    J = rows of the grounded and the colliding feet

dv = v+ - v-, I = impulses of the ground on the feet. S2 prints +lambda in eq. 5 where eq. 4 has
-lambda, so that its lambda would be minus the impulse, and a nabla for v+ - v-; the sign here is
that of eq. 4. All feet of J are at rest afterwards; no energy is gained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.contact_set import Grip
from hexapod_pin.formulations.rigid.kkt import solve_ranked
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.sticking import FootCheck, check_sticking

PULL = 1e-12
"""Impulses [N s] and speeds [m/s] this small have no sign."""


@dataclass(frozen=True)
class Impact:
    """What a plastic impact leaves.

    Attributes:
        velocity: v+. Shape (nv,). Unique, whatever the rank.
        impulse: of the ground on all feet, world axes [N s]; those of smallest norm. (F, 3).
        unique: which impulse components are determined. Shape (F, 3).
        rank: of the rows.
        energy_loss: kinetic energy lost [J], never negative.
        checks: whether each foot of the impact could stay, foot by foot.
        feet: indices of the feet that are at rest afterwards.
        settled: False: `unilateral_impact` found no set of feet that only push.
    """

    velocity: Array
    impulse: Array
    unique: NDArray[np.bool_]
    rank: int
    energy_loss: float
    checks: tuple[FootCheck, ...]
    feet: tuple[int, ...]
    settled: bool = True


def plastic_impact(
    model: RigidModel,
    q: Array,
    v: Array,
    grounded: Sequence[int],
    colliding: Sequence[int],
    *,
    frictionless: bool = False,
) -> Impact:
    """Return velocities and impulses of a plastic impact in which all these feet stay.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity before. Shape (nv,).
        grounded: indices of feet at rest on the ground.
        colliding: indices of feet that arrive.
        frictionless: impulses along the normal only, so that feet go on sliding.

    Raises:
        ParameterError: a foot is both grounded and colliding, or named twice.
    """
    feet = (*grounded, *colliding)
    grip = Grip((), feet) if frictionless else Grip(feet)
    mass, all_rows, _, _ = model.positions(q)
    rows = grip.rows(all_rows, model.normal)
    found = solve_ranked(mass, np.zeros(len(v)), rows, arrest(rows, v))
    count = len(model.robot.feet)
    impulse = grip.spread(found.f, model.normal, count)
    unique = grip.spread_flags(found.unique, count)
    return Impact(
        velocity=v + found.x, impulse=impulse, unique=unique, rank=found.rank,
        energy_loss=-0.5 * float(found.f @ (rows @ v)),
        checks=check_sticking(model, feet, impulse, unique), feet=feet,
    )  # fmt: skip


def arrest(rows: Array, v: Array) -> Array:
    """Return the change of foot velocity that eq. 5 asks for: -J v-, all feet at rest after."""
    return -(rows @ v)


def unilateral_impact(
    model: RigidModel, q: Array, v: Array, grounded: Sequence[int], colliding: Sequence[int]
) -> Impact:
    """Return the impact in which feet that the ground would have to hold back leave it.

    Feet are let go one at a time, the most pulled first, and taken back if they would go into the
    ground. Where no set of feet only pushes, the last one is returned with `settled` False.
    """
    given = (*grounded, *colliding)
    inside, seen = set(given), set[frozenset[int]]()
    while frozenset(inside) not in seen:
        seen.add(frozenset(inside))
        found = plastic_impact(model, q, v, (), sorted(inside))
        wrong = _worst_foot(model, q, found, set(given) - inside)
        if wrong is None:
            return found
        inside ^= {wrong}
    return Impact(**{**vars(found), "settled": False})


def _worst_foot(model: RigidModel, q: Array, found: Impact, left: set[int]) -> int | None:
    """Return the foot that is pulled most, else the one let go that goes in fastest, else None."""
    push = found.impulse @ model.normal
    pulled = [k for k in found.feet if push[k] < -PULL]
    if pulled:
        return min(pulled, key=lambda k: float(push[k]))
    speed = model.positions(q)[1] @ found.velocity @ model.normal
    entering = [k for k in left if speed[k] < -PULL]
    return min(entering, key=lambda k: float(speed[k])) if entering else None

"""S2 appendix eq. 5: plastic impact of feet with rigid ground.

    [M -J^T; J 0] [dv; I] = [0; -J v-],    J = rows of the grounded and the colliding feet

dv = v+ - v-, I = impulses of the ground on the feet. S2 prints +lambda in eq. 5 where eq. 4 has
-lambda, so that its lambda would be minus the impulse, and a nabla for v+ - v-; the sign here is
that of eq. 4. All feet of J are at rest afterwards; no energy is gained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.constraints import ContactSet
from hexapod_pin.formulations.rigid.kkt import solve_kkt
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.sticking import StickingCheck, check_sticking

MIN_IMPULSE_N_S = 1e-12
"""Normal impulses smaller than this have no sign [N s]."""

MIN_SPEED_M_S = 1e-12
"""Normal speeds smaller than this have no sign [m/s]."""


@dataclass(frozen=True)
class PlasticImpact:
    """The solution of eq. 5.

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
    checks: tuple[StickingCheck, ...]
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
) -> PlasticImpact:
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
    contacts = ContactSet((), feet) if frictionless else ContactSet(feet)
    mass, all_rows, _, _ = model.positions(q)
    rows = contacts.rows(all_rows, model.normal)
    found = solve_kkt(mass, np.zeros(len(v)), rows, required_velocity_change(rows, v))
    count = len(model.robot.feet)
    impulse = contacts.forces(found.f, model.normal, count)
    unique = contacts.force_flags(found.unique, count)
    return PlasticImpact(
        velocity=v + found.x, impulse=impulse, unique=unique, rank=found.rank,
        energy_loss=-0.5 * float(found.f @ (rows @ v)),
        checks=check_sticking(model, feet, impulse, unique), feet=feet,
    )  # fmt: skip


def required_velocity_change(rows: Array, v: Array) -> Array:
    """Return the right side of eq. 5, -J v-: all feet at rest afterwards."""
    return -(rows @ v)


def unilateral_impact(
    model: RigidModel, q: Array, v: Array, grounded: Sequence[int], colliding: Sequence[int]
) -> PlasticImpact:
    """Return the impact in which feet that the ground would have to hold down leave it.

    Feet are released one at a time, the most pulled first, and taken back if they would enter the
    ground. Where no set of feet only pushes, the last one is returned with `settled` False.
    """
    given = (*grounded, *colliding)
    inside, seen = set(given), set[frozenset[int]]()
    while frozenset(inside) not in seen:
        seen.add(frozenset(inside))
        found = plastic_impact(model, q, v, (), sorted(inside))
        wrong = _most_violating_foot(model, q, found, set(given) - inside)
        if wrong is None:
            return found
        inside ^= {wrong}
    return replace(found, settled=False)


def _most_violating_foot(
    model: RigidModel, q: Array, found: PlasticImpact, released: set[int]
) -> int | None:
    """Return the foot pulled most, else the released one that enters fastest, else None."""
    normal_impulse = found.impulse @ model.normal
    pulled = [k for k in found.feet if normal_impulse[k] < -MIN_IMPULSE_N_S]
    if pulled:
        return min(pulled, key=lambda k: float(normal_impulse[k]))
    speed = model.positions(q)[1] @ found.velocity @ model.normal
    entering = [k for k in released if speed[k] < -MIN_SPEED_M_S]
    return min(entering, key=lambda k: float(speed[k])) if entering else None

"""Contact phases on rigid ground end at events; a landing is a plastic impact (S2 eq. 5).

A foot that arrives ends the phase with S2 appendix eq. 5. A foot whose normal force turns negative
first loses its friction and slides, since its cone has closed, and is released when it is pulled
again; a sliding foot that carries load again sticks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError
from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper, Snapshot
from hexapod_pin.formulations.rigid.derivative import (
    ContactSet,
    StickingCheck,
    check_sticking,
    solve_kkt,
)
from hexapod_pin.formulations.rigid.model import RigidModel

if TYPE_CHECKING:
    from hexapod_pin.robot.state import State


EVENT_TIME_TOLERANCE_S = 1e-7
"""To which events are located [s]."""

RESTICK_LOAD_SHARE = 0.02
"""A sliding foot sticks again when it carries this share of the weight [-]; *assumed*."""

MAX_EVENTS_PER_SAMPLE = 200
"""Events between two samples before a run is given up."""

TOUCH_GAP_M = 1e-9
"""A foot nearer to the ground than this touches it [m]."""


@dataclass(frozen=True)
class TouchDownImpact:
    """A plastic impact of a run.

    Attributes:
        time: [s].
        feet: names of the feet that came down, or were loaded again after they had slid.
        held_back: names of the feet whose impulse pulls: eq. 5 keeps them down, ground could not.
        impulse: on all feet, world axes [N s]. Shape (F, 3).
        energy_loss: [J].
    """

    time: float
    feet: tuple[str, ...]
    held_back: tuple[str, ...]
    impulse: Array
    energy_loss: float


class ContactEventLoop:
    """Advances a run from event to event.

    Attributes:
        stepper: takes the steps between events.
        now: the state reached.
        contacts: the feet in contact now.
        impacts: all touch-downs so far.
        releases: how often a foot was released.
        steps: accepted so far.
        energy: work and losses since the start [J].
    """

    def __init__(self, stepper: ConstrainedStepper, start: State) -> None:
        """Begin with the feet that touch the ground, less those that it would pull."""
        self.stepper, self._model = stepper, stepper.model
        self.impacts: list[TouchDownImpact] = []
        self.releases = self.steps = 0
        self.energy = {"servo_work": 0.0, "joint_damping_loss": 0.0, "normal_loss": 0.0}
        weight = self._model.robot.total_mass * float(np.linalg.norm(self._model.gravity))
        self._restick_force = RESTICK_LOAD_SHARE * weight
        gap = self._model.gaps(start.q)
        self.contacts = ContactSet(tuple(k for k in range(len(gap)) if gap[k] <= TOUCH_GAP_M))
        self.now = self._released(stepper.snapshot(0.0, start.q, start.v, self.contacts))

    def advance(self, until: float, step: float) -> None:
        """Go on to a time [s] in steps of at most `step` [s], cut short at events.

        Raises:
            DivergenceError: events follow each other without end.
        """
        events = 0
        while until - self.now.time > EVENT_TIME_TOLERANCE_S:
            ahead = until - self.now.time
            after, event = self._step_to_event(ahead if ahead <= step * (1.0 + 1e-9) else step)
            self._accumulate_work(after)
            self.now, self.steps = after, self.steps + 1
            if event:
                arriving = self._arriving(self.now)
                if arriving:
                    self._impact(arriving)
                self.now = self._released(self.now)
                events += 1
            self._restick()
            if events > MAX_EVENTS_PER_SAMPLE:
                raise DivergenceError(
                    f"feet come and go without end at t = {self.now.time:g} s: no set of feet that "
                    "stick, slide or leave lasts. Try gentler set-points or compliant contact.",
                    None,
                )

    def _step_to_event(self, h: float) -> tuple[Snapshot, bool]:
        """Return the snapshot after a step, or just after the first event within it (bisection)."""
        after = self.stepper.step(self.now, h, self.contacts)
        if not self._is_past_event(after):
            return after, False
        low, high = 0.0, h
        while high - low > EVENT_TIME_TOLERANCE_S:
            middle = 0.5 * (low + high)
            tried = self.stepper.step(self.now, middle, self.contacts)
            if self._is_past_event(tried):
                high, after = middle, tried
            else:
                low = middle
        return after, True

    def _is_past_event(self, snapshot: Snapshot) -> bool:
        return bool(self._pulled(snapshot) or self._arriving(snapshot))

    def _normal_force(self, snapshot: Snapshot) -> Array:
        return np.asarray(snapshot.solution.force @ self._model.normal)

    def _pulled(self, snapshot: Snapshot) -> list[int]:
        force = self._normal_force(snapshot)
        return [k for k in self.contacts.feet if force[k] < 0.0]

    def _arriving(self, snapshot: Snapshot) -> list[int]:
        speed = snapshot.terms.rows @ snapshot.v @ self._model.normal
        inside = (snapshot.terms.gap < -TOUCH_GAP_M) & (speed < 0.0)
        return [k for k in range(len(inside)) if inside[k] and k not in self.contacts.feet]

    def _restick(self) -> None:
        """Let sliding feet under load stick again, unless sticking pulls some foot at once."""
        force = self._normal_force(self.now)
        for foot in [k for k in self.contacts.sliding if force[k] > self._restick_force]:
            before = self.now, self.contacts, dict(self.energy)
            self._impact([foot])
            if self._pulled(self.now):
                self.now, self.contacts, self.energy = before
                self.impacts.pop()

    def _released(self, snapshot: Snapshot) -> Snapshot:
        """Release feet whose normal force is negative, the most pulled first.

        A foot that stuck loses its friction first (a cone without load is closed), then its
        contact. Returns the snapshot with the feet that are left.
        """
        while pulled := self._pulled(snapshot):
            force = self._normal_force(snapshot)
            foot = min(pulled, key=lambda k: float(force[k]))
            sticking = tuple(k for k in self.contacts.sticking if k != foot)
            sliding = tuple(k for k in self.contacts.sliding if k != foot)
            if foot in self.contacts.sticking:
                sliding = (*sliding, foot)
            else:
                self.releases += 1
            self.contacts = ContactSet(sticking, sliding)
            snapshot = self.stepper.snapshot(snapshot.time, snapshot.q, snapshot.v, self.contacts)
        return snapshot

    def _impact(self, feet: list[int]) -> None:
        """Apply the plastic impact of these feet with those that stick."""
        now, names = self.now, self._model.foot_names
        sliding = tuple(k for k in self.contacts.sliding if k not in feet)
        found = plastic_impact(self._model, now.q, now.v, self.contacts.sticking, feet)
        held_back = tuple(check.foot for check in found.checks if check.verdict == "pulls")
        arrived = tuple(names[k] for k in feet)
        self.impacts.append(
            TouchDownImpact(now.time, arrived, held_back, found.impulse, found.energy_loss)
        )
        self.energy["normal_loss"] += found.energy_loss
        self.contacts = ContactSet(tuple(sorted(found.feet)), sliding)
        self.now = self.stepper.snapshot(now.time, now.q, found.velocity, self.contacts)

    def _accumulate_work(self, after: Snapshot) -> None:
        """Add the work of a step, by the trapezoidal rule."""
        h = after.time - self.now.time
        damping = self._model.robot.damping
        for end in (self.now, after):
            rate = end.v[6:]
            self.energy["servo_work"] += 0.5 * h * float(end.solution.torque @ rate)
            self.energy["joint_damping_loss"] += 0.5 * h * float(damping @ rate**2)


# S2 appendix eq. 5: plastic impact of feet with rigid ground.
#
#     [M -J^T; J 0] [dv; I] = [0; -J v-],    J = rows of the grounded and the colliding feet
#
# dv = v+ - v-, I = impulses of the ground on the feet. S2 prints +lambda in eq. 5 where eq. 4 has
# -lambda, so that its lambda would be minus the impulse, and a nabla for v+ - v-; the sign here is
# that of eq. 4. All feet of J are at rest afterwards; no energy is gained.

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

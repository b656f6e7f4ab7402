"""The phases of a walk on rigid ground: which feet are held, and the events that change it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError
from hexapod_pin.formulations.rigid.constrained_step import Drive, Moment
from hexapod_pin.formulations.rigid.contact_set import Grip
from hexapod_pin.formulations.rigid.impact import plastic_impact

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import State

INSTANT = 1e-7
"""To which events are located [s]."""

LOADED = 0.02
"""A sliding foot sticks again when it carries this share of the weight; *assumed*."""

MOST_EVENTS = 200
"""Events between two samples before a walk is given up."""

TOUCHING = 1e-9
"""A foot nearer to the ground than this touches it [m]."""


@dataclass(frozen=True)
class TouchDown:
    """A plastic impact of a walk.

    Attributes:
        time: [s].
        feet: names of the feet that came down, or were pressed on again after they had let go.
        held_back: names of the feet whose impulse pulls: eq. 5 keeps them down, ground could not.
        impulse: on all feet, world axes [N s]. Shape (F, 3).
        energy_loss: [J].
    """

    time: float
    feet: tuple[str, ...]
    held_back: tuple[str, ...]
    impulse: Array
    energy_loss: float


class Walker:
    """The state of a walk: now, which feet are held, what has happened."""

    def __init__(self, drive: Drive, start: State) -> None:
        """Put the feet that touch and do not leave on the ground."""
        self.drive, self.model = drive, drive.model
        self.impacts: list[TouchDown] = []
        self.releases = self.steps = 0
        self.energy = {"servo_work": 0.0, "joint_damping_loss": 0.0, "normal_loss": 0.0}
        gap = self.model.gaps(start.q)
        self.grip = Grip(tuple(k for k in range(len(gap)) if gap[k] <= TOUCHING))
        self.loaded = (
            LOADED * self.model.robot.total_mass * float(np.linalg.norm(self.model.gravity))
        )
        self.now = self._settled(drive.moment(0.0, start.q, start.v, self.grip))

    def advance(self, until: float, step: float) -> None:
        """Go on to a time [s], event by event."""
        events = 0
        while until - self.now.time > INSTANT:
            ahead = until - self.now.time
            after, event = self._to_event(ahead if ahead <= step * (1.0 + 1e-9) else step)
            self._account(after)
            self.now, self.steps = after, self.steps + 1
            if event:
                self._happen()
                events += 1
            self._press()
            if events > MOST_EVENTS:
                raise DivergenceError(
                    f"feet come and go without end at t = {self.now.time:g} s: no set of feet that "
                    "stick, slide or leave lasts. Try gentler set-points or compliant contact.",
                    None,
                )

    def _to_event(self, h: float) -> tuple[Moment, bool]:
        """Return the moment after a step, or just after the first event within it."""
        after = self.drive.step(self.now, h, self.grip)
        if not self._broken(after):
            return after, False
        low, high = 0.0, h
        while high - low > INSTANT:
            middle = 0.5 * (low + high)
            tried = self.drive.step(self.now, middle, self.grip)
            if self._broken(tried):
                high, after = middle, tried
            else:
                low = middle
        return after, True

    def _broken(self, moment: Moment) -> bool:
        return bool(self._pulled(moment) or self._arriving(moment))

    def _push(self, moment: Moment) -> Array:
        push: Array = moment.motion.force @ self.model.normal
        return push

    def _pulled(self, moment: Moment) -> list[int]:
        push = self._push(moment)
        return [k for k in self.grip.feet if push[k] < 0.0]

    def _arriving(self, moment: Moment) -> list[int]:
        speed = moment.terms.rows @ moment.v @ self.model.normal
        low = (moment.terms.gap < -TOUCHING) & (speed < 0.0)
        return [k for k in range(len(low)) if low[k] and k not in self.grip.feet]

    def _happen(self) -> None:
        """Strike feet that arrive, and let go of those that are pulled."""
        arriving = self._arriving(self.now)
        if arriving:
            self._strike(arriving)
        self.now = self._settled(self.now)

    def _press(self) -> None:
        """Let sliding feet that bear load again stick, where sticking does not pull at once."""
        push = self._push(self.now)
        for foot in [k for k in self.grip.smooth if push[k] > self.loaded]:
            before = self.now, self.grip, dict(self.energy)
            self._strike([foot])
            if self._pulled(self.now):
                self.now, self.grip, self.energy = before
                self.impacts.pop()

    def _settled(self, moment: Moment) -> Moment:
        """Let go of feet that are pulled, the most pulled first; return the moment without them.

        A foot that stuck first loses its friction (a cone without load is closed), then its hold.
        """
        while pulled := self._pulled(moment):
            push = self._push(moment)
            foot = min(pulled, key=lambda k: float(push[k]))
            stuck = tuple(k for k in self.grip.stuck if k != foot)
            smooth = tuple(k for k in self.grip.smooth if k != foot)
            if foot in self.grip.stuck:
                smooth = (*smooth, foot)
            else:
                self.releases += 1
            self.grip = Grip(stuck, smooth)
            moment = self.drive.moment(moment.time, moment.q, moment.v, self.grip)
        return moment

    def _strike(self, feet: list[int]) -> None:
        now, names = self.now, self.model.foot_names
        smooth = tuple(k for k in self.grip.smooth if k not in feet)
        found = plastic_impact(self.model, now.q, now.v, self.grip.stuck, feet)
        held_back = tuple(check.foot for check in found.checks if check.verdict == "pulls")
        struck = tuple(names[k] for k in feet)
        self.impacts.append(
            TouchDown(now.time, struck, held_back, found.impulse, found.energy_loss)
        )
        self.energy["normal_loss"] += found.energy_loss
        self.grip = Grip(tuple(sorted(found.feet)), smooth)
        self.now = self.drive.moment(now.time, now.q, found.velocity, self.grip)

    def _account(self, after: Moment) -> None:
        """Add the work of a step, by the trapezoidal rule."""
        h = after.time - self.now.time
        damping = self.model.robot.damping
        for moment in (self.now, after):
            rate = moment.v[6:]
            self.energy["servo_work"] += 0.5 * h * float(moment.motion.torque @ rate)
            self.energy["joint_damping_loss"] += 0.5 * h * float(damping @ rate**2)

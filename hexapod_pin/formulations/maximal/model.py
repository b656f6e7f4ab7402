"""Newton-Euler equations of bodies with joints as constraints (S1 eq. 1).

    [M  -D'] [v'    ]   [f                                  ]
    [D   0 ] [lambda] = [gamma - 2 alpha Phi' - beta^2 Phi  ]

v stacks velocities of centres of mass and angular velocities, world axes; f gravity, -w x I w,
foot forces and joint torques; D' lambda are the joint reactions on the bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal import reduced
from hexapod_pin.formulations.maximal.baumgarte import Baumgarte
from hexapod_pin.formulations.maximal.constraints import Constraints, constraints
from hexapod_pin.formulations.maximal.drives import Drives
from hexapod_pin.formulations.maximal.elimination import Elimination, Rows
from hexapod_pin.formulations.maximal.evaluation import Evaluation
from hexapod_pin.formulations.maximal.joint_vectors import AXIS, local_vectors
from hexapod_pin.formulations.maximal.memory import Memory
from hexapod_pin.formulations.maximal.motion import BodyState, assembled
from hexapod_pin.formulations.maximal.mount import Mount
from hexapod_pin.formulations.maximal.placement import Placement, placed
from hexapod_pin.formulations.maximal.rotation import cross, rotations

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.foot_ground import FootGround
    from hexapod_pin.formulations.maximal.touch import Touch

Command = Callable[["Array", "Array"], "Array"]
"""Servo torques (nj,) [N m] from joint angles [rad] and rates [rad/s]."""


class MaximalModel:
    """Bodies, their joints and what acts on them.

    Attributes:
        bodies: the bodies.
        drives: at the joints.
        feet: on the ground; None in empty space.
        gravity: (3,) [m/s^2], world axes.
        baumgarte: stabilisation.
        mount: of the root.
    """

    def __init__(
        self,
        bodies: Bodies,
        *,
        drives: Drives | None = None,
        feet: FootGround | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
        baumgarte: Baumgarte | None = None,
        mount: Mount | None = None,
    ) -> None:
        """Put the parts together; nothing given means limp joints, empty space, a free root."""
        self.bodies, self.feet = bodies, feet
        self.drives = drives or Drives.of(bodies)
        self.gravity = np.array(gravity, dtype=float)
        self.baumgarte = baumgarte or Baumgarte.off()
        self.mount = mount or Mount.free()
        self.contacts = 0 if feet is None else feet.contacts
        self.eliminate = Elimination(bodies)
        self._vectors = local_vectors(bodies)
        self._pin = np.array(self.mount.point) + bodies.root_origin
        self._weight = np.zeros((len(bodies.mass), 6))
        self._weight[:, :3] = bodies.mass[:, None] * self.gravity
        self._first = np.eye(len(bodies.mass))[:, bodies.parent]  # adds joints up on parents

    def state(self, q: ArrayLike, v: ArrayLike) -> BodyState:
        """Return the state of all bodies; q, v are base pose, angles, rates: see `assembled`."""
        return assembled(self.bodies, np.asarray(q, dtype=float), np.asarray(v, dtype=float))

    def fresh_memory(self, angles: ArrayLike | None = None) -> Memory:
        """Return the memory of a run's beginning; angles (nj,) [rad], zero if not given."""
        near = np.zeros(len(self.bodies.joint_names)) if angles is None else np.array(angles)
        return Memory.fresh(near, self.contacts)

    def place(self, state: BodyState) -> Placement:
        """Return where everything is."""
        return placed(self.bodies, self._vectors, state)

    def constraints(self, state: BodyState, at: Placement) -> Constraints:
        """Return the joints' constraints."""
        return constraints(self.bodies.parent, state, at.on_parent, at.on_child)

    def rows(self, at: Placement, joints: Constraints) -> Rows:
        """Return the blocks of D, the mount's with them."""
        return Rows(joints.on_parent, joints.on_child, self.mount.rows(at.turn[0] @ self._pin))

    def mount_violation(self, state: BodyState, at: Placement) -> Array:
        """Return Phi (h,) of the mount."""
        return self.mount.violation(state.position[0], at.turn[0] @ self._pin)

    def gaps(self, time: float, state: BodyState) -> Array:
        """Return the gaps of all contacts (C,) [m], negative inside the ground."""
        if self.feet is None:
            return np.empty(0)
        return self.feet.gaps(time, state.position, rotations(state.quaternion))

    def evaluate(
        self,
        time: float,
        state: BodyState,
        torque: Array | Command,
        memory: Memory | None = None,
        stretch: Array | None = None,
    ) -> Evaluation:
        """Return accelerations and multipliers.

        Args:
            time: [s]; only shaken ground looks at it.
            state: of the bodies.
            torque: of the servos (nj,) [N m], or a function of angles and rates.
            memory: of joints and contacts; none: contacts never seen.
            stretch: (C, 3) of the bristles [m]; none: zero.
        """
        memory = self.fresh_memory() if memory is None else memory
        at = self.place(state)
        joints = self.constraints(state, at)
        angle = memory.unwrapped(at.angle)
        servo = torque(angle, at.rate) if callable(torque) else torque
        passive = self.drives.passive(angle, at.rate)
        force, touch = self._force(time, state, at, servo + passive, memory, stretch)
        rows = self.rows(at, joints)
        wanted, hold = self._wanted(state, at, joints, rows)
        rates, multipliers, support = self.eliminate(at.mass, force, rows, wanted, hold)
        return Evaluation(rates, multipliers, support, servo, passive, at, joints, touch)

    def reduced_acceleration(self, state: BodyState, found: Evaluation) -> Array:
        """Return (6 + nj,) as a reduced-coordinate core gives it: see `reduced.acceleration`."""
        return reduced.acceleration(self.bodies, state, found.acceleration)

    def _force(
        self, time: float, state: BodyState, at: Placement, torque: Array, memory: Memory,
        stretch: Array | None,
    ) -> tuple[Array, Touch | None]:  # fmt: skip
        """Return f (nb, 6)."""
        force = self._weight.copy()
        force[:, 3:] += gyroscopic(at.inertia, state.velocity[:, 3:])
        if len(torque):
            moment = torque[:, None] * at.on_parent.value[:, :, AXIS]
            force[1:, 3:] += moment
            force[:, 3:] -= self._first @ moment
        if self.feet is None:
            return force, None
        bristles = np.zeros((self.contacts, 3)) if stretch is None else stretch
        on_feet, touch = self.feet(time, state.position, at.turn, state.velocity, bristles, memory)
        return force + on_feet, touch

    def _wanted(
        self, state: BodyState, at: Placement, joints: Constraints, rows: Rows
    ) -> tuple[Array, Array]:
        """Return the right side of the constraints, for the joints (nj, 5) and the mount (h,)."""
        twice, square = 2.0 * self.baumgarte.alpha, self.baumgarte.beta**2
        wanted = joints.gamma - twice * joints.rate - square * joints.violation
        if not self.mount.held:
            return wanted, rows.mount[:, 0]
        hold = self.mount.gamma(at.turn[0] @ self._pin, state.velocity[0, 3:])
        hold = hold - twice * (rows.mount @ state.velocity[0])
        return wanted, hold - square * self.mount_violation(state, at)


def gyroscopic(inertia: Array, spin: Array) -> Array:
    """Return -w x I w (nb, 3) [N m]."""
    momentum = np.matmul(inertia, spin[:, :, None])[:, :, 0]
    return -cross(spin, momentum)

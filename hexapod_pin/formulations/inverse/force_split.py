"""Feet share a load by least squares, within the linearised friction cone.

S2 does not state its split; each result carries the label of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.formulations.inverse.stance import StanceLoad, stance_load
from hexapod_pin.formulations.rigid.model import RigidGround, RigidModel
from hexapod_pin.formulations.truncated_svd import pseudo_inverse
from hexapod_pin.robot.rotations import perpendicular


class ForceSplit(Protocol):
    """A rule that picks one set of foot forces."""

    @property
    def label(self) -> str:
        """Its name in reports."""
        ...

    def share(self, load: StanceLoad) -> Array:
        """Return foot forces, world axes (3k,) [N]."""
        ...


@dataclass(frozen=True)
class MinimumNorm:
    """The forces of least sum of squares: balance alone, no compliance; feet may be pulled."""

    label: str = "minimum norm"

    def share(self, load: StanceLoad) -> Array:
        """Return the forces (3k,) [N]."""
        inverse, _ = pseudo_inverse(load.base_rows.T)
        return inverse @ load.wrench


@dataclass(frozen=True)
class Compliant:
    """The forces of least elastic energy: feet on linear springs, joints on their servos.

    The rest of a robot that was put down free of internal stress and whose feet stick
    (Castigliano): energy = sum f.C f / 2 + sum tau^2 / (2 kp). Feet may be pulled.

    Attributes:
        normal: contact stiffness along the normal [N/m]; infinite is rigid.
        tangential: contact stiffness within the ground [N/m].
        servo: joint stiffness kp [N m/rad]; infinite is rigid.
        label: its name in reports.
    """

    normal: float = math.inf
    tangential: float = math.inf
    servo: float = math.inf
    label: str = "compliant"

    def __post_init__(self) -> None:
        """Check that something is compliant.

        Raises:
            ParameterError: a stiffness is not positive, or none is finite where one must be.
        """
        for name in ("normal", "tangential", "servo"):
            if not getattr(self, name) > 0.0:
                raise ParameterError(f"Compliant.{name}", getattr(self, name), "above 0")
        if math.isinf(self.servo) and math.isinf(max(self.normal, self.tangential)):
            raise ParameterError(
                "Compliant.servo", self.servo, "finite, or both contact stiffnesses"
            )

    def share(self, load: StanceLoad) -> Array:
        """Return the forces (3k,) [N]."""
        inverse, null = pseudo_inverse(load.base_rows.T)
        particular = inverse @ load.wrench
        compliance = self._contact(load) + load.joint_rows @ load.joint_rows.T / self.servo
        slack = load.joint_rows @ load.free_torque / self.servo - compliance @ particular
        inner = null.T @ compliance @ null
        choice = np.linalg.solve(inner, null.T @ slack).astype(np.float64)
        return particular + null @ choice

    def _contact(self, load: StanceLoad) -> Array:
        along = np.outer(load.normal, load.normal)
        one = along / self.normal + (np.eye(3) - along) / self.tangential
        blocks = np.kron(np.eye(len(load.feet)), one).astype(np.float64)
        return blocks


@dataclass(frozen=True)
class LeastTorque:
    """The torques of least sum of squares, feet inside their cones, torques inside their limits.

    The friction cone is replaced by the pyramid inside it, so that the forces are always allowed;
    with 8 sides it is at most 1 - cos(pi/8) = 7.6 % too strict.

    Attributes:
        sides: of the pyramid.
        limited: whether torques keep to the joints' efforts.
        label: its name in reports.
    """

    sides: int = 8
    limited: bool = True
    label: str = "least torque"

    def share(self, load: StanceLoad) -> Array:
        """Return the forces (3k,) [N].

        Raises:
            InfeasibleError: no forces inside cones and limits balance the robot.
        """
        torque_map = load.joint_rows.T
        cone = np.kron(np.eye(len(load.feet)), pyramid(load.normal, load.mu, self.sides))
        bound = np.zeros(len(cone))
        if self.limited:
            cone = np.vstack([cone, torque_map, -torque_map])
            above, below = load.free_torque - load.effort, -load.free_torque - load.effort
            bound = np.concatenate([bound, above, below])
        use = np.isfinite(bound) & (np.linalg.norm(cone, axis=1) > 0.0)
        return least_squares(
            torque_map, load.free_torque, load.base_rows.T, load.wrench, cone[use], bound[use]
        )


# Coulomb's cone as linear inequalities, and how far a stance is from tipping.

FEWEST_SIDES = 3
"""Sides of the coarsest pyramid."""

NO_SLIP_FRICTION = 100.0
"""Coefficient of friction [-] with which nothing slips below `STEEPEST_SLOPE_RAD`."""

STEEPEST_SLOPE_RAD = math.radians(89.0)
"""Where the search for the tipping slope ends [rad]."""


def pyramid(normal: Array, mu: float, sides: int = 8) -> Array:
    """Return rows g with g f >= 0 for every force f in the pyramid inside the cone |f_t| <= mu f_n.

    Args:
        normal: unit normal. Shape (3,).
        mu: coefficient of friction [-].
        sides: of the pyramid; mu = 0 leaves the normal direction alone in the limit.

    Returns:
        Shape (sides + 1, 3); the last row is the normal itself.

    Raises:
        ParameterError: fewer than three sides.
    """
    if sides < FEWEST_SIDES:
        raise ParameterError("sides", sides, f"at least {FEWEST_SIDES}")
    first = perpendicular(normal)
    second = np.cross(normal, first)
    angle = 2.0 * math.pi * np.arange(sides) / sides
    outward = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    inside = mu * math.cos(math.pi / sides)
    return np.vstack([inside * normal - outward, normal])


def normal_force_margin(load: StanceLoad, sides: int = 8) -> float:
    """Return the force that can be taken off the normal force of every foot at once [N].

    The largest s with all forces less s along the normal still inside their pyramids. Negative: the
    stance tips or slides, some foot would have to be held down. Minus infinity: no forces balance
    the load at all. A linear program (`scipy.optimize.linprog`).
    """
    from scipy.optimize import linprog

    count = len(load.feet)
    faces = pyramid(load.normal, load.mu, sides)
    cone = np.hstack([np.kron(np.eye(count), -faces), np.tile(faces @ load.normal, count)[:, None]])
    balance = np.hstack([load.base_rows.T, np.zeros((6, 1))])
    found = linprog(
        np.append(np.zeros(3 * count), -1.0), A_ub=cone, b_ub=np.zeros(len(cone)),
        A_eq=balance, b_eq=load.wrench, bounds=(None, None), method="highs",
    )  # fmt: skip
    return -float(found.fun) if found.success else -math.inf


def tipping_slope(
    model: RigidModel, q: Array, heading: float, feet: Sequence[int] | None = None
) -> float:
    """Return the slope at which a standing robot tips [rad], rising along `heading` [rad].

    The robot stays on its plane and gravity turns; joints are locked and nothing slips.

    Args:
        model: robot and level ground.
        q: configuration on the level plane. Shape (nq,).
        heading: of the rise, from x to y [rad].
        feet: indices of the grounded feet; None: all.
    """
    from scipy.optimize import brentq

    standing = range(len(model.robot.feet)) if feet is None else feet
    size = float(np.linalg.norm(model.gravity))
    rough = RigidGround(mu=NO_SLIP_FRICTION, normal=model.ground.normal, point=model.ground.point)

    def margin(angle: float) -> float:
        """Return the normal-force margin at a slope [N]."""
        uphill = np.array([math.cos(heading), math.sin(heading), 0.0])
        down = -math.sin(angle) * uphill - [0.0, 0.0, math.cos(angle)]
        tilted = RigidModel(model.robot, ground=rough, gravity=size * down)
        zero = np.zeros(tilted.model.nv)
        return normal_force_margin(stance_load(tilted, q, zero, zero, standing))

    return float(brentq(margin, 0.0, STEEPEST_SLOPE_RAD, xtol=1e-12, rtol=1e-14))


# Small least-squares problems under linear equations and inequalities, solved exactly.
#
# A strictly convex quadratic program with linear constraints is a least-distance problem, and that
# is one call of non-negative least squares (Lawson & Hanson 1974, ch. 23): finite, no tolerance to
# tune (`scipy.optimize.nnls`). The active constraints are then solved as equations, which takes the
# answer to rounding.

EQUATION_ROUNDING = 1e-10
"""Share of the largest bound by which a point without a choice may break an inequality [-]."""

INFEASIBLE_RESIDUAL = 1e-10
"""Residual of the non-negative problem, at most 1, below which there is no solution [-]."""


class InfeasibleError(HexapodError):
    """No values meet all equations and inequalities."""


def least_squares(a: Array, b: Array, rows: Array, target: Array, g: Array, h: Array) -> Array:
    """Return the x of least |a x - b| with rows x = target and g x >= h.

    Args:
        a: of full column rank on the null space of `rows`. Shape (p, n).
        b: shape (p,).
        rows: shape (m, n); any rank, but the equations must not contradict each other.
        target: shape (m,).
        g: shape (c, n).
        h: shape (c,).

    Raises:
        InfeasibleError: no x meets them.
    """
    inverse, null = pseudo_inverse(rows)
    x0 = inverse @ target
    if not null.shape[1]:
        return _checked(x0, g, h)
    q, r = np.linalg.qr(a @ null)
    back = null @ np.linalg.inv(r)  # x = x0 + back (y + q^T (b - a x0)), |a x - b| = |y| + rest
    middle = x0 + back @ (q.T @ (b - a @ x0))
    bound, normal = h - g @ middle, g @ back
    return middle + back @ _least_distance(normal, bound)


def _checked(x: Array, g: Array, h: Array) -> Array:
    if (g @ x < h - EQUATION_ROUNDING * max(1.0, float(np.abs(h).max(initial=0.0)))).any():
        raise InfeasibleError("the equations leave no choice, and break an inequality")
    return x


def _least_distance(normal: Array, bound: Array) -> Array:
    """Return the shortest y with normal y >= bound."""
    from scipy.optimize import nnls

    columns = normal.shape[1]
    size = np.linalg.norm(normal, axis=1)
    scaled = normal / size[:, None]
    reach = bound / size
    longest = float(reach.max(initial=0.0))
    if longest <= 0.0:
        return np.zeros(columns)
    system = np.vstack([scaled.T, reach / longest])
    wanted = np.append(np.zeros(columns), 1.0)
    weight, rest = nnls(system, wanted)
    if rest < INFEASIBLE_RESIDUAL:
        raise InfeasibleError("no forces meet the balance, the friction cones and the limits")
    active = weight > 0.0
    inverse, _ = pseudo_inverse(scaled[active])
    found: Array = inverse @ reach[active]
    return found

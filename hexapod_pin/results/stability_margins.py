"""Margins are taken in energy and at the zero-moment point.

Points are projected along gravity first; margins in the support polygon are those of
`robot.static_margins`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.static_margins import cross, pairs, sides, standing_points

# Energy stability margins: how high the centre of mass must rise before the robot tips over.
#
# Messuri & Klein 1985 take the least work m g h over the edges of the support polygon; Hirose et
# al. 2001 divide it by the weight (normalised energy stability margin, NESM): the least rise h [m].

EDGE_TOLERANCE = 1e-9
"""How far a point may lie outside an edge of the hull, as a share of the extent [-]."""


def edge_rise(first: ArrayLike, second: ArrayLike, com: ArrayLike, up: ArrayLike) -> Array:
    """Return the rise of a centre of mass that turns about an edge until it is above it [m].

    h = |R| (1 - cos theta) cos psi: R from the edge to the centre of mass, at right angles to the
    edge; theta its angle to the vertical plane through the edge; psi the edge's slope. Here cos psi
    is the size of u, the part of `up` at right angles to the edge, and |R| cos theta cos psi is
    R . u. On a level edge at distance d below a centre of mass at height z: sqrt(z^2 + d^2) - z.

    Args:
        first: one end of the edge [m]. Shape (..., 3).
        second: the other end, elsewhere [m]. Shape (..., 3).
        com: centre of mass [m]. Shape (..., 3).
        up: unit vector against gravity. Shape (3,).

    Returns:
        Shape (...), >= 0.
    """
    p, c, z = np.asarray(first), np.asarray(com), np.asarray(up)
    edge = np.asarray(second) - p
    edge = edge / np.linalg.norm(edge, axis=-1, keepdims=True)
    R = c - p - np.sum((c - p) * edge, axis=-1, keepdims=True) * edge
    u = z - np.sum(edge * z, axis=-1, keepdims=True) * edge
    top = np.linalg.norm(R, axis=-1) * np.linalg.norm(u, axis=-1)
    now = np.sum(R * u, axis=-1)
    # top - now without cancellation where now > 0: top^2 - now^2 = |R x u|^2
    gap = np.sum(np.cross(R, u) ** 2, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rise: Array = np.where(now > 0.0, gap / (top + now), top - now)
    return rise


@checked
def nesm(
    points: ArrayLike,
    com: ArrayLike,
    grounded: ArrayLike | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
) -> Array:
    """Return the normalised energy stability margin, the least rise over the polygon's edges [m].

    An edge beyond which the centre of mass already lies counts as minus its rise: the height that
    is lost since it was above the edge. So the margin is 0 on the boundary, and negative outside
    and on two points; on one point it is minus the rise about that point; without any -inf. Where
    points of an edge lie at several heights, each pair of them is an edge.

    Args:
        points: contact points [m]. Shape (..., m, 3).
        com: centre of mass [m]. Shape (..., 3).
        grounded: which points stand; None: all. Shape (..., m).
        gravity: its direction counts. Shape (3,).

    Returns:
        Shape (...).

    Raises:
        ParameterError: shapes do not fit, or there is no gravity.
    """
    axes = horizontal_axes(gravity)
    p, stands = standing_points(points, com, grounded)
    if p.shape[-2] == 0:
        return np.full(stands.shape, -np.inf)
    first, second = pairs(p.shape[-2])
    flat, origin = p @ axes[:2].T, np.zeros(3)
    edge = flat[..., second, :] - flat[..., first, :]
    length = np.linalg.norm(edge, axis=-1)
    slack = EDGE_TOLERANCE * length * length.max(axis=-1, initial=0.0)[..., None]
    side = sides(flat, edge, first)
    own = -cross(edge, flat[..., first, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = edge_rise(p[..., first, :], p[..., second, :], origin, axes[2])
    left = (length > 0.0) & (side.min(axis=-1) >= -slack)
    right = (length > 0.0) & (side.max(axis=-1) <= slack)
    margins = np.minimum(
        np.where(left, np.sign(own) * rise, np.inf), np.where(right, -np.sign(own) * rise, np.inf)
    )
    least = margins.min(axis=-1, initial=np.inf)
    arm = -p[..., 0, :]
    least = np.where(np.isfinite(least), least, arm @ axes[2] - np.linalg.norm(arm, axis=-1))
    return np.where(stands, least, -np.inf)


# The zero-moment point of a trace, from the feet's forces and from the motion of the bodies.
#
# The zero-moment point (Vukobratovic & Borovac 2004) is where the ground's reaction has no moment
# within the ground. Forces of feet that only push, on one plane, put it inside the support polygon,
# where it is the centre of pressure (Sardain & Bessonnet 2004); at the boundary the robot tips.
#
# Foot forces of a trace are means over the interval that ends at their sample. So is the point: the
# moment is that of mean forces at the contact points in the middle of the interval, or the change
# of angular momentum over it. The first sample of a run has the force of that instant.


def contact_points(trace: Trace) -> Array:
    """Return the lowest points of the feet along the ground's normal, world axes [m]. (T, F, 3).

    Raises:
        ParameterError: the trace does not contain the radii of its feet.
    """
    radius = trace.run.robot.foot_radius
    if radius is None or len(radius) != len(trace.foot_names):
        allowed = f"given with {len(trace.foot_names)} foot_radius [m]"
        raise ParameterError("Trace.run.robot.foot_radius", radius, allowed)
    return trace.foot_position - np.asarray(radius, dtype=float)[:, None] * trace.foot_normal


def at_middles(values: Array) -> Array:
    """Return the means of samples and the ones before; the first stays. (T, ...)."""
    means = values.copy()
    means[1:] = 0.5 * (values[1:] + values[:-1])
    return means


def ground_plane(trace: Trace) -> tuple[Array, Array]:
    """Return a point of, and the unit normal to, the plane in which the point is sought.

    The normal is the mean of those under the loaded feet, the point the mean of the contact points,
    both weighted by normal force: on level or sloping ground the plane is the ground itself. NaN
    where no foot is loaded.

    Returns:
        World axes, in the middle of the intervals [m, -]. Shape (T, 3) each.
    """
    pressing = np.einsum("tfi,tfi->tf", trace.mean_foot_force, trace.foot_normal)
    weight = np.maximum(pressing, 0.0)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = weight / weight.sum(axis=1, keepdims=True)
        normal = np.sum(weight * trace.foot_normal, axis=1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.sum(weight * at_middles(contact_points(trace)), axis=1), normal


def point_of_wrench(force: Array, moment: Array, origin: Array, normal: Array) -> Array:
    """Return the point of a plane about which a wrench has no moment within the plane [m].

    p = o + n x M / (n . F), with M about a point o of the plane.

    Args:
        force: F [N]. Shape (..., 3).
        moment: M [N m]. Shape (..., 3).
        origin: o [m]. Shape (..., 3).
        normal: n, unit normal of the plane. Shape (..., 3).

    Returns:
        Shape (..., 3); NaN where the wrench does not press on the plane.
    """
    pressing = np.sum(normal * force, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        arm = np.where(pressing > 0.0, np.cross(normal, moment) / pressing, np.nan)
    found: Array = origin + arm
    return found


@checked
def zero_moment_point(trace: Trace) -> Array:
    """Return the zero-moment point from the forces on the feet, world axes [m].

    Returns:
        Shape (T, 3); NaN where no foot is loaded.

    Raises:
        ParameterError: the trace does not contain the radii of its feet.
    """
    origin, normal = ground_plane(trace)
    arms = at_middles(contact_points(trace)) - origin[:, None]
    force = trace.mean_foot_force
    moment = np.cross(arms, force).sum(axis=1)
    return point_of_wrench(force.sum(axis=1), moment, origin, normal)


@checked
def zero_moment_point_of_motion(trace: Trace) -> Array:
    """Return the zero-moment point from the rates of the bodies' momenta and gravity alone [m].

    Newton and Euler: what is not gravity's in the change of linear and angular momentum over an
    interval is the ground's. No contact force is used, but for choosing the plane. Pushes on the
    robot count as the ground's here, and in `zero_moment_point` they do not.

    Returns:
        World axes. Shape (T, 3); NaN for the first sample, which ends no interval.

    Raises:
        ParameterError: the robot cannot be built again from the trace.
    """
    robot = RecordedRobot.of(trace)
    origin, normal = ground_plane(trace)
    linear, angular, com = robot.momenta(trace.q, trace.v)
    mass, gravity = robot.total_mass, robot.gravity
    step = np.diff(trace.time)[:, None]
    force = np.diff(linear, axis=0) / step - mass * gravity
    about_world = angular + np.cross(com, linear)
    middle = 0.5 * (com[1:] + com[:-1])
    moment = np.diff(about_world, axis=0) / step - np.cross(middle, mass * gravity)
    moment -= np.cross(origin[1:], force)
    found = point_of_wrench(force, moment, origin[1:], normal[1:])
    return np.concatenate([np.full((1, 3), np.nan), found])


# Axes across gravity and against it: what points are projected on.

PARALLEL_TOLERANCE = 1e-12
"""Sine of the angle to the x axis below which gravity counts as along it [-]."""


def horizontal_axes(gravity: ArrayLike) -> Array:
    """Return unit axes across gravity and up against it, as rows; world x, y, z for level ground.

    Args:
        gravity: acceleration, world axes [m/s^2]. Shape (3,).

    Raises:
        ParameterError: there is no gravity, or it points along the world's x axis.
    """
    size = float(np.linalg.norm(gravity))
    if not (np.isfinite(size) and size > 0.0):
        raise ParameterError("gravity", gravity, "a finite vector other than zero [m/s^2]")
    up = -np.asarray(gravity, dtype=float) / size
    first = np.array([1.0, 0.0, 0.0]) - up[0] * up
    length = float(np.linalg.norm(first))
    if length < PARALLEL_TOLERANCE:
        raise ParameterError("gravity", gravity, "not along the world's x axis")
    first /= length
    return np.stack([first, np.cross(up, first), up])

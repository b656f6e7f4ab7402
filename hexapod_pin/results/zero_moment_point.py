"""The zero-moment point of a trace, from the feet's forces and from the motion of the bodies.

The zero-moment point (Vukobratovic & Borovac 2004) is where the ground's reaction has no moment
within the ground. Forces of feet that only push, on one plane, put it inside the support polygon,
where it is the centre of pressure (Sardain & Bessonnet 2004); at the boundary the robot tips.

Foot forces of a trace are means over the interval that ends at their sample. So is the point: the
moment is that of mean forces at the contact points in the middle of the interval, or the change of
angular momentum over it. The first sample of a run has the force of that instant.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.trace import Trace


def contact_points(trace: Trace) -> Array:
    """Return the lowest points of the feet along the ground's normal, world axes [m]. (T, F, 3).

    Raises:
        ParameterError: the trace does not tell the radii of its feet.
    """
    radius = trace.meta.get("foot_radius")
    if radius is None or len(radius) != len(trace.foot_names):
        allowed = f"given with {len(trace.foot_names)} foot_radius [m]"
        raise ParameterError("Trace.meta", sorted(trace.meta), allowed)
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


def zero_moment_point(trace: Trace) -> Array:
    """Return the zero-moment point from the forces on the feet, world axes [m].

    Returns:
        Shape (T, 3); NaN where no foot is loaded.

    Raises:
        ParameterError: the trace does not tell the radii of its feet.
    """
    origin, normal = ground_plane(trace)
    arms = at_middles(contact_points(trace)) - origin[:, None]
    force = trace.mean_foot_force
    moment = np.cross(arms, force).sum(axis=1)
    return point_of_wrench(force.sum(axis=1), moment, origin, normal)


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
    mass, gravity = robot.mass, robot.gravity
    step = np.diff(trace.time)[:, None]
    force = np.diff(linear, axis=0) / step - mass * gravity
    about_world = angular + np.cross(com, linear)
    middle = 0.5 * (com[1:] + com[:-1])
    moment = np.diff(about_world, axis=0) / step - np.cross(middle, mass * gravity)
    moment -= np.cross(origin[1:], force)
    found = point_of_wrench(force, moment, origin[1:], normal[1:])
    return np.concatenate([np.full((1, 3), np.nan), found])

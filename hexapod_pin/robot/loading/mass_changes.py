"""A model with other masses: bodies fixed to links for good, taken from them, or scaled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.loading.pin_model import placement

if TYPE_CHECKING:
    import pinocchio as pin


class AddedBody(NamedTuple):
    """A rigid body on a link.

    Attributes:
        link: name of the link, also one that is fixed to another.
        mass: [kg].
        position: its centre of mass in the link's frame [m]. Shape (3,).
        inertia: about its centre of mass, along the link's axes [kg m^2]. Shape (3, 3).
    """

    link: str
    mass: float
    position: Array
    inertia: Array


class RemovedPoint(NamedTuple):
    """A point mass [kg] taken from a link, at a place in the link's frame [m]."""

    link: str
    mass: float
    position: Array


class ScaledBodies(NamedTuple):
    """A factor on mass and inertia of the moved bodies that links belong to; of all without one."""

    links: tuple[str, ...]
    factor: float


MassChange = AddedBody | RemovedPoint | ScaledBodies


def symmetric_matrix(moments: Sequence[float] | None) -> Array:
    """Return the (3, 3) inertia of (ixx, iyy, izz, ixy, ixz, iyz) [kg m^2]; zero for None."""
    xx, yy, zz, xy, xz, yz = moments or (0.0,) * 6
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def mass_change(load: Mapping[str, Any]) -> MassChange | None:
    """Return what a load, as plain data of a scene, does to the masses; None: nothing."""
    position = np.array(load.get("position", (0.0, 0.0, 0.0)), dtype=float)
    if load["kind"] == "payload":
        inertia = symmetric_matrix(load.get("inertia"))
        return AddedBody(load["link"], float(load["mass"]), position, inertia)
    if load["kind"] == "removed-mass":
        return RemovedPoint(load["link"], float(load["mass"]), position)
    if load["kind"] == "mass-factor":
        return ScaledBodies(tuple(load.get("links", ())), float(load["factor"]))
    return None


def with_mass_changes(bare: pin.Model, changes: Sequence[MassChange]) -> pin.Model:
    """Return a copy of a model with other masses: scaled first, then added, then removed.

    Raises:
        UnknownNameError: no such link.
        ParameterError: more is taken from a body than it contains.
    """
    import pinocchio as pin

    model = pin.Model(bare)
    for scaling in (x for x in changes if isinstance(x, ScaledBodies)):
        for joint in _bodies(model, scaling.links):
            model.inertias[joint] = _scaled(model.inertias[joint], scaling.factor)
    for body in (x for x in changes if isinstance(x, AddedBody)):
        name, place = placement(model, body.link)
        inertia = pin.Inertia(body.mass, np.array(body.position, dtype=float), body.inertia)
        model.inertias[model.getJointId(name)] += place.act(inertia)
    for point in (x for x in changes if isinstance(x, RemovedPoint)):
        name, place = placement(model, point.link)
        joint = model.getJointId(name)
        where = place.act(np.array(point.position, dtype=float))
        model.inertias[joint] = _without(model.inertias[joint], point, where)
    return model


def _bodies(model: pin.Model, links: Sequence[str]) -> list[int]:
    """Return the moved bodies that links belong to, each once; all where no link is named."""
    if not links:
        return list(range(1, model.njoints))
    return sorted({int(model.getJointId(placement(model, link)[0])) for link in links})


def _scaled(body: pin.Inertia, factor: float) -> pin.Inertia:
    import pinocchio as pin

    return pin.Inertia(factor * body.mass, body.lever, factor * body.inertia)


def _without(body: pin.Inertia, point: RemovedPoint, where: Array) -> pin.Inertia:
    """Return what is left of a body without a point mass of it.

    The point's inertia about the body's centre of mass c is m (|r|^2 1 - r r^T) with r = p - c;
    what is left has its own centre of mass, to which Steiner's theorem takes it.
    """
    import pinocchio as pin

    left = body.mass - point.mass
    if left <= 0.0:
        raise _too_much(point, f"{left:.4g} kg are left")
    arm = where - body.lever
    shift = -point.mass / left * arm  # of the centre of mass
    inertia = body.inertia - point.mass * _of_point(arm) - left * _of_point(shift)
    small, middle, large = np.linalg.eigvalsh(inertia)
    if small < 0.0 or small + middle < large:
        moments = f"{small:.3g}, {middle:.3g}, {large:.3g}"
        raise _too_much(point, f"principal moments of {moments} kg m^2 are left")
    return pin.Inertia(left, body.lever + shift, inertia)


def _of_point(arm: Array) -> Array:
    """Return the inertia of a unit point mass about a point it is an arm away from [m^2]."""
    matrix: Array = arm @ arm * np.eye(3) - np.outer(arm, arm)
    return matrix


def _too_much(point: RemovedPoint, left: str) -> ParameterError:
    return ParameterError(
        f"mass removed from {point.link}", point.mass,
        f"of what the link contains there [kg]: {left}, which no rigid body has",
        "Take less away, or take it from the link on the other side of the joint.",
    )  # fmt: skip

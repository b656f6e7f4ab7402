"""Bodies fixed to the links of a model for good: their inertias join those of the links."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
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


def symmetric_matrix(moments: Sequence[float] | None) -> Array:
    """Return the (3, 3) inertia of (ixx, iyy, izz, ixy, ixz, iyz) [kg m^2]; zero for None."""
    xx, yy, zz, xy, xz, yz = moments or (0.0,) * 6
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def with_bodies(bare: pin.Model, bodies: Sequence[AddedBody]) -> pin.Model:
    """Return a copy of a model with bodies on its links.

    Raises:
        UnknownNameError: no such link.
    """
    import pinocchio as pin

    model = pin.Model(bare)
    for body in bodies:
        name, place = placement(model, body.link)
        inertia = pin.Inertia(body.mass, np.array(body.position, dtype=float), body.inertia)
        model.inertias[model.getJointId(name)] += place.act(inertia)
    return model

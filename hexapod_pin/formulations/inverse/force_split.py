"""Splits: how feet share a load that the six equations of the base leave open.

S2 does not say which it takes; each result carries the label of its split.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.inverse.friction_pyramid import pyramid
from hexapod_pin.formulations.inverse.least_squares import least_squares
from hexapod_pin.formulations.inverse.stance import StanceLoad
from hexapod_pin.formulations.truncated_svd import pseudo_inverse


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

"""Loads change a robot: payloads, pushes, lost legs, and masses that are removed or scaled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    field_validator,
    model_validator,
)

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.description.solids import INERTIA_RELATIVE_TOLERANCE, symmetric_matrix
from hexapod_pin.robot.loading.pin_model import placement
from hexapod_pin.spec import Kilograms, Spec

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


# A body that a robot carries.


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


Triple = Annotated[tuple[float, float, float], BeforeValidator(_plain)]
Moments = tuple[float, float, float, float, float, float]
Name = Annotated[str, Field(min_length=1)]
GivenInertia = Sequence[float] | Sequence[Sequence[float]] | Array


class Payload(Spec):
    """A rigid body fixed to a link from the start to the end of a run.

    Attributes:
        link: name of a link, also one that is fixed to another.
        mass: mass [kg].
        position: its centre of mass in the link's frame [m].
        inertia: (ixx, iyy, izz, ixy, ixz, iyz) about its centre of mass, along the link's axes
            [kg m^2]; given as these six numbers or as a 3x3 matrix; None is a point mass.
    """

    kind: Literal["payload"] = "payload"
    link: Name
    mass: Annotated[Kilograms, Field(gt=0.0)]
    position: Triple = (0.0, 0.0, 0.0)
    inertia: Moments | None = None

    def __init__(
        self,
        link: str,
        mass: float,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        inertia: GivenInertia | None = None,
        **others: Any,
    ) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        moments = inertia if inertia is None else _six_numbers(inertia)
        super().__init__(link=link, mass=mass, position=position, inertia=moments, **others)

    @model_validator(mode="after")
    def _is_a_rigid_body(self) -> Payload:
        small, middle, large = np.linalg.eigvalsh(self.inertia_matrix)
        slack = INERTIA_RELATIVE_TOLERANCE * abs(large)
        if small < -slack or small + middle < large - slack:
            raise ParameterError(
                "Payload.inertia",
                self.inertia,
                "that of a rigid body: principal moments not negative, and the two smaller ones "
                f"add up to the largest at least ({small:.6g}, {middle:.6g}, {large:.6g} kg m^2)",
            )
        return self

    @property
    def inertia_matrix(self) -> Array:
        """(3, 3) inertia about the centre of mass, along the link's axes [kg m^2]."""
        return symmetric_matrix(self.inertia)


def _six_numbers(inertia: GivenInertia) -> list[float]:
    """Return (ixx, iyy, izz, ixy, ixz, iyz) of these numbers or of a matrix.

    Raises:
        ParameterError: it is neither.
    """
    matrix = np.asarray(inertia)
    if matrix.shape == (3, 3) and np.array_equal(matrix, matrix.T):
        matrix = matrix[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    if matrix.shape != (6,):
        allowed = "six numbers or a symmetric 3x3 matrix [kg m^2]"
        raise ParameterError("Payload.inertia", inertia, allowed)
    return list(matrix.tolist())


# Changes of a robot's own masses: links scaled, and mass taken away.


class MassFactor(Spec):
    """Mass and inertia of links times a factor: a robot heavier or lighter than in its file.

    Attributes:
        factor: on mass and inertia [-]; centres of mass stay.
        links: names of links; each stands for all that is rigidly fixed to it. Empty: all links.
    """

    kind: Literal["mass-factor"] = "mass-factor"
    factor: PositiveFloat
    links: tuple[Name, ...] = ()

    def __init__(self, factor: float, links: Sequence[str] = (), **others: Any) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(factor=factor, links=links, **others)

    @field_validator("links", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value


class RemovedMass(Spec):
    """A point mass taken away from a link that contains it, such as a motor to be replaced.

    Attributes:
        link: name of a link, also one that is fixed to another.
        mass: what is taken away [kg].
        position: where it was, in the link's frame [m].
    """

    kind: Literal["removed-mass"] = "removed-mass"
    link: Name
    mass: PositiveFloat
    position: Triple = (0.0, 0.0, 0.0)

    def __init__(
        self, link: str, mass: float, position: Sequence[float] = (0.0, 0.0, 0.0), **others: Any
    ) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(link=link, mass=mass, position=position, **others)


MassLoad = Payload | MassFactor | RemovedMass


def links_of(load: MassLoad) -> tuple[str, ...]:
    """Return the links that a load names."""
    return load.links if isinstance(load, MassFactor) else (load.link,)


# What a scene puts on a robot or takes from it: payloads, other masses, pushes, lost legs.


class Push(Spec):
    """A force and a torque, constant in world axes, on a point fixed to a link.

    Attributes:
        link: name of a link, also one that is fixed to another.
        position: the point in the link's frame [m].
        force: force on the robot, world axes [N].
        torque: torque on the robot, world axes [N m].
        start: when it begins [s].
        duration: how long it lasts [s].
    """

    kind: Literal["push"] = "push"
    link: Name
    position: Triple = (0.0, 0.0, 0.0)
    force: Triple = (0.0, 0.0, 0.0)
    torque: Triple = (0.0, 0.0, 0.0)
    start: NonNegativeFloat
    duration: PositiveFloat

    def __init__(
        self,
        link: str,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        *,
        force: Sequence[float] | None = None,
        torque: Sequence[float] | None = None,
        start: float,
        duration: float,
        **others: Any,
    ) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        if force is None and torque is None:
            raise ParameterError("Push.force", None, "given [N], or Push.torque [N m]")
        wrench = {"force": force, "torque": torque}
        given = {name: value for name, value in wrench.items() if value is not None}
        times = {"start": start, "duration": duration}
        super().__init__(link=link, position=position, **given, **times, **others)

    @property
    def end(self) -> float:
        """When it ends [s]."""
        return self.start + self.duration


class LostLeg(Spec):
    """A leg whose drives give no torque from a time on.

    Attributes:
        leg: name of the leg: lf, lm, lr, rf, rm or rr.
        start: when it is lost [s].
    """

    kind: Literal["lost-leg"] = "lost-leg"
    leg: Name
    start: NonNegativeFloat

    def __init__(self, leg: str, start: float, **others: Any) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(leg=leg, start=start, **others)


Load = MassLoad | Push | LostLeg

TYPES: tuple[type[Load], ...] = (Payload, MassFactor, RemovedMass, Push, LostLeg)

KINDS = {str(load.model_fields["kind"].default): load for load in TYPES}


def read_loads(items: Any) -> list[Load]:
    """Return the loads that `load_to_dict` turned into plain data.

    Raises:
        ParameterError: not a list of tables, `kind` missing or unknown, a field missing, or a
            value out of range.
    """
    if not isinstance(items, Sequence) or not all(isinstance(x, Mapping) for x in items):
        raise ParameterError("loads", items, "a list of tables")
    return [_read_load(index, item) for index, item in enumerate(items)]


def _read_load(index: int, data: Mapping[str, Any]) -> Load:
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ParameterError(f"loads[{index}].kind", kind, f"one of {', '.join(KINDS)}")
    load = KINDS[kind]
    for name, field in load.model_fields.items():
        if field.is_required() and name not in data:
            raise ParameterError(f"loads[{index}].{name}", None, "given: it has no default")
    return load(**data)


def load_to_dict(load: Load) -> dict[str, Any]:
    """Return a load as TOML-able data."""
    return load.model_dump(exclude_none=True)


MOST_CARRIED = 50.0
"""Payload over the robot's own mass [-]: walking machines carry up to a few times their mass, ants
up to fifty times theirs. A heavier payload was given in grams."""


def checked_loads(robot: Robot, loads: Sequence[Load]) -> tuple[Load, ...]:
    """Return the loads of a scene, checked against its robot.

    Raises:
        ParameterError: not a sequence of loads, a leg that is lost twice, or a payload of more than
            `MOST_CARRIED` times the robot's mass.
        UnknownNameError: a link or leg that the robot does not have; names the load.
    """
    if not isinstance(loads, Sequence) or not all(isinstance(x, Load) for x in loads):
        names = ", ".join(kind.__name__ for kind in KINDS.values())
        raise ParameterError("Scene.loads", loads, f"a list of {names}")
    lost: set[str] = set()
    most = MOST_CARRIED * robot.total_mass
    for index, load in enumerate(loads):
        if isinstance(load, Payload) and robot.legs and load.mass > most:
            allowed = f"at most {most:.4g} kg, {MOST_CARRIED:g} times the robot's mass"
            hint = f"grams? {load.mass:g} g are {1e-3 * load.mass:.4g} kg."
            raise ParameterError(f"Scene.loads[{index}].mass", load.mass, allowed, hint)
        part = "leg" if isinstance(load, LostLeg) else "link"
        try:
            if isinstance(load, LostLeg):
                robot.leg(load.leg)
            else:
                for link in (load.link,) if isinstance(load, Push) else links_of(load):
                    placement(robot.model, link)
        except UnknownNameError as error:
            where = f"{part} (Scene.loads[{index}].{part})"
            raise UnknownNameError(where, error.name, error.known) from None
        if isinstance(load, LostLeg):
            if load.leg in lost:
                raise ParameterError(f"Scene.loads[{index}].leg", load.leg, "lost only once")
            lost.add(load.leg)
    return tuple(loads)

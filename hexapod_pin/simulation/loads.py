"""What a scene puts on a robot or takes from it: payloads, other masses, pushes, lost legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat, field_validator

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.loading.pin_model import placement
from hexapod_pin.simulation.mass_changes import MassFactor, MassLoad, RemovedMass, links_of
from hexapod_pin.simulation.payload import Name, Payload, Triple
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


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

    @field_validator("position", "force", "torque", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value

    @property
    def end(self) -> float:
        """When it ends [s]."""
        return self.start + self.duration


class LostLeg(Spec):
    """A leg whose drives give no torque from a time on.

    Attributes:
        leg: name of the leg: lf, lm, lr, rf, rm or rr.
        time: when it is lost [s].
    """

    kind: Literal["lost-leg"] = "lost-leg"
    leg: Name
    time: NonNegativeFloat

    def __init__(self, leg: str, time: float, **others: Any) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        super().__init__(leg=leg, time=time, **others)


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


def checked_loads(robot: Robot, loads: Sequence[Load]) -> tuple[Load, ...]:
    """Return the loads of a scene, checked against its robot.

    Raises:
        ParameterError: not a sequence of loads, or a leg that is lost twice.
        UnknownNameError: a link or leg that the robot does not have; names the load.
    """
    if not isinstance(loads, Sequence) or not all(isinstance(x, Load) for x in loads):
        names = ", ".join(kind.__name__ for kind in KINDS.values())
        raise ParameterError("Scene.loads", loads, f"a list of {names}")
    lost: set[str] = set()
    for index, load in enumerate(loads):
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

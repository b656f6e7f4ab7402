"""Inputs of a study change the scene: contact, servos, motors, ground, gravity and loads."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.drive.catalog import Catalog, MotorRecord, load_catalog
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import AnyTerrain, Flat, HeightField
from hexapod_pin.scene.loads import Load, MassFactor, Payload
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.sweep.base_case import gait_of
from hexapod_pin.study.sweep.fields import suggestion
from hexapod_pin.study.sweep.study_file import StudyInput

Values = Mapping[str, Any]
Options = Mapping[str, Mapping[str, Any]]

LEAST_LENGTH = 0.5
"""Way for which there are bumps at least [m]."""


def contact_with(contact: Contact, values: Values) -> Contact:
    """Return a contact with another friction coefficient and stiffness."""
    if "mu" in values:
        contact = contact.with_mu(values["mu"])
    if "contact_stiffness" in values:
        contact = contact.stiffer(values["contact_stiffness"])
    return contact


def servo_with(servo: Servo, values: Values) -> Servo:
    """Return servos of another stiffness."""
    return servo.stiffer(values["servo_stiffness"]) if "servo_stiffness" in values else servo


def gravity_with(gravity: tuple[float, float, float], values: Values) -> tuple[float, float, float]:
    """Return gravity as on a slope that rises along +x: the ground stays level, gravity tilts."""
    angle = values["slope"] if "slope" in values else math.radians(values["slope_deg"])
    size = math.hypot(*gravity)
    return -size * math.sin(angle), 0.0, -size * math.cos(angle)


def loads_with(
    loads: tuple[Load, ...], values: Values, options: Options, trunk: str
) -> tuple[Load, ...]:
    """Return loads with mass factors and a payload more; one of 0 kg is none."""
    found = list(loads)
    if "mass" in values:
        found.append(MassFactor(values["mass"]))
    if "trunk_mass" in values:
        found.append(MassFactor(values["trunk_mass"], (trunk,)))
    if values.get("payload"):
        given = options["payload"]
        place = (0.0, 0.0, 0.0) if given["position"] is None else given["position"]
        found.append(Payload(given["link"] or trunk, values["payload"], place))
    return tuple(found)


def terrain_with(base: Case, values: Values, options: Options) -> AnyTerrain:
    """Return random bumps; those of height 0 are level ground."""
    height, given = values["bumps"], options["bumps"]
    if height == 0.0:
        return Flat()
    flat = given["flat_radius"]
    scene: Scene = random_bumps(
        base.scene,
        [int(values.get("bumps_seed", 0))],
        amplitude=height,
        wavelength=given["wavelength"],
        length=travelled_length(base) if given["length"] is None else given["length"],
        flat_radius=standing_radius(base) if flat is None else flat,
    )[0]
    return scene.terrain


def standing_radius(base: Case) -> float:
    """Return how far the feet stand from the middle of the trunk, at most [m]; 0 without legs."""
    try:
        feet = leg_group(base.scene.robot).neutral_feet
    except GaitError:
        return 0.0
    return max(math.hypot(x, y) for x, y, _ in feet.tolist())


def refused_scene_input(base: Case, name: str) -> str:
    """Return why an input does not fit the scene of the base; empty where it does."""
    scene = base.scene
    if name == "servo_stiffness":
        if scene.prescribed:
            return "the base's motion is prescribed: no servo acts"
        if not scene.servos.gains(scene.robot)[0].any():
            return "the base's servos have no stiffness: kp = 0"
    if name in ("motor", "voltage") and scene.prescribed:
        return "the base's motion is prescribed: no motor acts"
    if name in ("slope", "slope_deg") and (scene.gravity[:2] != (0.0, 0.0) or scene.gravity[2] > 0):
        return "the base's gravity is tilted already"
    if name == "bumps" and not isinstance(scene.terrain, Flat):
        return f"the base's terrain is not level: {scene.terrain.kind}"
    return ""


def travelled_length(base: Case) -> float:
    """Return the distance that the base's gait walks in its duration [m], at least 0.5."""
    gait = gait_of(base.controller)
    speed = 0.0 if gait is None else gait.speed
    return max(LEAST_LENGTH, speed * (base.duration or 0.0))


# Servos with motors of a catalogue, at the voltage of a supply.

KEYS = ("motor", "voltage", "catalog")
"""What the base may say of its motors."""


@dataclass(frozen=True, eq=False)
class StudyMotors:
    """The motors of a study.

    Attributes:
        catalog: where they are looked for.
        motor: of the base; None: none.
        voltage: of the base's supply [V]; None: that of the catalogue's record.
    """

    catalog: Catalog
    motor: str | None
    voltage: float | None

    @classmethod
    def of(cls, base: Mapping[str, Any], folder: Path) -> StudyMotors:
        """Read the motors of the table `base`.

        Raises:
            ParameterError: no text, no voltage, or no such motor.
            CatalogError: the catalogue is not usable.
        """
        name, voltage, path = (base.get(key) for key in KEYS)
        for key, value in (("motor", name), ("catalog", path)):
            if value is not None and not (isinstance(value, str) and value):
                raise ParameterError(f"base.{key}", value, "text")
        if voltage is not None and not _is_voltage(voltage):
            raise ParameterError("base.voltage", voltage, "a number above 0 [V]")
        found = cls(load_catalog(None if path is None else folder / path), name, voltage)
        if name is not None:
            found.record(name, voltage, "base.motor")
        return found

    def record(self, name: str, voltage: float | None, where: str) -> MotorRecord:
        """Return a record by its name, or that of a model whose voltage is nearest.

        Raises:
            ParameterError: there is none, or several and no voltage to choose by.
        """
        self._require_known(name, where)
        try:
            if voltage is not None:
                return self.catalog.supplied(name, voltage)[0]
            return self.catalog.get(name)
        except ParameterError as error:
            if voltage is not None:
                raise
            allowed = f"{error.allowed} by its whole name, or beside a voltage"
            raise ParameterError(where, name, allowed, error.hint) from error

    def _require_known(self, name: str, where: str) -> None:
        known = [*self.catalog.models, *(record.name for record in self.catalog)]
        if name.strip().casefold() not in {other.casefold() for other in known}:
            raise ParameterError(where, name, f"one of {', '.join(known)}", suggestion(name, known))

    def servo_with(self, servo: Servo, values: Mapping[str, Any]) -> Servo:
        """Return servos with the motor that the values, or the base, name.

        Raises:
            ParameterError: the motor has no torque-speed line, or is not made for the voltage.
        """
        name = values.get("motor", self.motor)
        if name is None:
            return servo
        voltage = values.get("voltage", self.voltage)
        record = self.record(name, voltage, "motor")
        ratio = 1.0 if voltage is None else voltage / record.voltage
        return servo.model_copy(update={"motor": record.motor(ratio)})

    def check(self, inputs: Sequence[StudyInput]) -> None:
        """Refuse names that the catalogue does not have, and a voltage of no motor.

        Raises:
            ParameterError: naming the place in the file.
        """
        named = {item.name: item for item in inputs}
        voltage = named.get("voltage")
        if voltage is not None and "motor" not in named and self.motor is None:
            allowed = "beside an input motor, or base.motor: their catalogue has the rated voltage"
            raise ParameterError(f"{voltage.where}.input", "voltage", allowed)
        if self.voltage is not None and "motor" not in named and self.motor is None:
            allowed = "left out without base.motor or an input motor"
            raise ParameterError("base.voltage", self.voltage, allowed)
        if "motor" in named:
            item = named["motor"]
            for k, name in enumerate(item.names):
                where = f"{item.where}.values[{k}]"
                if voltage is None:
                    self.record(name, self.voltage, where)
                else:  # a voltage that a motor is not made for is refused case by case
                    self._require_known(name, where)

    def meaning(self, inputs: Sequence[StudyInput]) -> dict[str, Any] | None:
        """Return the records that cases may take, as plain data; None where no input is of them."""
        named = {item.name: item for item in inputs}
        if not named.keys() & {"motor", "voltage"}:
            return None
        names = named["motor"].names if "motor" in named else (self.motor or "",)
        models = {r.model for r in self.catalog for n in names
                  if n.strip().casefold() in (r.model.casefold(), r.name.casefold())}  # fmt: skip
        records = [r.model_dump(mode="json") for r in self.catalog if r.model in models]
        return {"motor": self.motor, "voltage": self.voltage, "records": records}


def _is_voltage(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0.0 < value < float("inf")  # type: ignore[operator]


# Scenes on random bumps, one per seed.


@checked
def random_bumps(
    scene: Scene,
    seeds: Iterable[int],
    *,
    amplitude: float,
    wavelength: float,
    length: float,
    flat_radius: float = 0.0,
) -> list[Scene]:
    """Return the scene on a new random ground for each seed.

    Args:
        scene: the robot and all else; its terrain is replaced.
        seeds: one per scene; the same seed gives the same ground.
        amplitude: largest height and depth [m].
        wavelength: typical distance between bumps [m].
        length: distance to walk from the origin, in any direction [m]; the ground is 1 m larger.
        flat_radius: the ground is level up to this distance from the origin [m].

    Raises:
        ParameterError: a length is not positive, the bumps are steeper than 60 degrees, or the
            ground has too many points (a longer wavelength has fewer).
    """
    size = 2.0 * (length + 1.0)
    return [
        replace(
            scene,
            terrain=HeightField.random(
                seed, amplitude=amplitude, wavelength=wavelength, size=size, flat_radius=flat_radius
            ),
        )
        for seed in seeds
    ]

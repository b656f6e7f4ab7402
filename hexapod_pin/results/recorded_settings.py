"""What a run's scene, as TOML text in its `meta`, must be for what reads it back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import FileData, Name, NotNegative, Number, check_data
from hexapod_pin.spec import parsed_toml

Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]


class LawData(FileData):
    """A law of contact."""

    kind: Name


class ContactData(FileData):
    """`contact` of a scene."""

    normal: LawData | None = None
    friction: LawData | None = None


class LoadData(FileData):
    """One of `loads`."""

    kind: Name
    link: Name | None = None
    position: Vector | None = None
    force: Vector | None = None
    torque: Vector | None = None
    start: NotNegative | None = None
    duration: NotNegative | None = None


class RobotData(FileData):
    """`robot` of a scene."""

    feet: list[Name] | None = None


class SceneData(FileData):
    """What a scene's TOML text holds, as far as results need it."""

    robot: RobotData | None = None
    contact: ContactData | None = None
    loads: list[LoadData] = []
    servo: dict[str, Any] = {}
    terrain: dict[str, Any] | None = None
    prescribed: bool = False


def check_settings(meta: Mapping[str, Any]) -> None:
    """Check the texts of a run's `meta`; `meta` itself was checked before.

    Raises:
        ParameterError: a text is no TOML, or the scene is none.
    """
    for name in ("run", "scene", "controller"):
        text = meta.get(name)
        if text is None:
            continue
        try:
            found = dict(parsed_toml(text))
        except ParameterError as error:
            raise ParameterError(f"meta.{name}", error.value, error.allowed) from error
        if name == "scene":
            check_data(SceneData, "meta.scene", found)

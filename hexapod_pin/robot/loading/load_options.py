"""How a robot's file is read: hints about the robot, where its meshes are, whether it is mended."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.recognition.hints import RobotHints
from hexapod_pin.spec import read_toml
from hexapod_pin.user_file import read_text

HINTS_SUFFIX = ".hints.toml"
"""robot.urdf (or robot.urdf.xacro) takes hints from robot.hints.toml beside it."""


class LoadOptions(RobotHints):
    """How a robot is loaded; what is left out is inferred.

    Attributes:
        package_path: folders in which packages and meshes are looked for, before anywhere else.
        xacro_args: arguments of a xacro file.
        mend: whether the file's faults are mended before anything else.
        mass: of the whole robot, for a mend [kg], 1e-6 to 1e6.
        density: of its parts, for a mend [kg/m^3], 1e-3 to 1e5.
        effort: of all joints, for a mend [N m], 1e-9 to 1e6.
        velocity: of all joints, for a mend [rad/s], 1e-9 to 1e4.
    """

    package_path: tuple[str, ...] = ()
    xacro_args: dict[str, str] = Field(default_factory=dict)
    mend: bool = False
    mass: float | None = Field(default=None, ge=1e-6, le=1e6)
    density: float | None = Field(default=None, ge=1e-3, le=1e5)
    effort: float | None = Field(default=None, ge=1e-9, le=1e6)
    velocity: float | None = Field(default=None, ge=1e-9, le=1e4)

    def given(self) -> dict[str, Any]:
        """Return what differs from the defaults, as TOML-able data."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def over(self, hints: LoadOptions) -> LoadOptions:
        """Return these options, those of `hints` where nothing is given."""
        return LoadOptions(**{**hints.model_dump(exclude_defaults=True), **self.given()})


def hints_path(urdf: Path) -> Path:
    """Return where the hints of a URDF are kept: its name up to the first dot, and HINTS_SUFFIX."""
    return urdf.with_name(urdf.name.split(".")[0] + HINTS_SUFFIX)


def read_hints(urdf: Path) -> LoadOptions:
    """Return the hints beside a URDF; none where there is no such file.

    Raises:
        ParameterError: the file is not TOML, or has a key or a value that is not allowed.
    """
    try:
        path = hints_path(urdf)
        if not path.exists():
            return LoadOptions()
    except (OSError, ValueError):  # no name for a file: the robot's own is refused for it
        return LoadOptions()
    text = read_text(path, "hints file")
    try:
        return LoadOptions(**read_toml(text))
    except ParameterError as error:
        allowed, hint = error.allowed, f"{error.hint} It stands in {path}.".strip()
        raise ParameterError(error.name, error.value, allowed, hint) from error

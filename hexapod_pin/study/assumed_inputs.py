"""What is not known of a robot, as distributions that are *assumed* and say why."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.robot import leg_length

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hexapod_pin.robot.robot import Robot

PAYLOAD_SHARE = 0.2
"""Largest payload over the robot's mass (*assumed*)."""

BUMP_SHARE = 0.02
"""Largest bumps over the length of a leg (*assumed*)."""

BUMP_SEEDS = 8
"""Different grounds."""

DIGITS = 3
"""Significant digits of numbers that follow from the robot."""


@dataclass(frozen=True)
class AssumedInput(Immutable):
    """An input with an assumed distribution.

    Attributes:
        table: its table `[[vary]]` of a study file.
        reason: why it is so.
    """

    table: Mapping[str, Any]
    reason: str

    def __post_init__(self) -> None:
        """Make the table read-only."""
        object.__setattr__(self, "table", MappingProxyType(dict(self.table)))

    @property
    def name(self) -> str:
        """Name of the input."""
        return str(self.table["input"])

    @property
    def text(self) -> str:
        """What is assumed, in one line."""
        rest = {key: value for key, value in self.table.items() if key != "input"}
        numbers = ", ".join(f"{key} {value}" for key, value in rest.items())
        return f"{self.name}: {numbers} (assumed: {self.reason})"


@checked
def assumed_inputs(robot: Robot, *, prescribed: bool = False) -> tuple[AssumedInput, ...]:
    """Return *assumed* distributions of what is seldom known before a robot is built.

    Args:
        robot: payload follows its mass, bumps the length of its legs.
        prescribed: whether joints follow their plan exactly: then there is no servo to be unsure
            of.

    Raises:
        GaitError: the robot has no legs that a gait can move.

    Example:
        >>> vary = [dict(item.table) for item in assumed_inputs(case.scene.robot)]
        >>> design = {"kind": "sobol-indices", "samples": 64}
        >>> study = SweepStudy.of_case(case, vary, design)
    """
    found = [
        _payload(robot),
        AssumedInput(
            {"input": "mu", "distribution": "uniform", "low": 0.4, "high": 0.9},
            "rubber feet on floors from dusty to clean",
        ),
        AssumedInput(
            {"input": "contact_stiffness", "distribution": "lognormal", "median": 1.0,
             "factor": 2.0, "low": 0.1, "high": 10.0},
            "moduli of rubber lie within 1 to 20 MPa about the contact's 5 MPa, and its shape "
            "is not measured",
        ),
        AssumedInput(
            {"input": "servo_stiffness", "distribution": "lognormal", "median": 1.0,
             "factor": 1.5, "low": 0.25, "high": 4.0},
            "makers publish no stiffness: the gains' own rule is a guess within about two",
        ),
        AssumedInput(
            {"input": "mass", "distribution": "normal", "mean": 1.0, "deviation": 0.05,
             "low": 0.8, "high": 1.2},
            "cables, screws and glue are seldom drawn: files and scales differ by some percent",
        ),
        _bumps(robot),
        AssumedInput(
            {"input": "bumps_seed", "distribution": "choice", "values": list(range(BUMP_SEEDS))},
            f"{BUMP_SEEDS} different grounds",
        ),
    ]  # fmt: skip
    return tuple(item for item in found if not (prescribed and item.name == "servo_stiffness"))


def _payload(robot: Robot) -> AssumedInput:
    most = _short(PAYLOAD_SHARE * robot.total_mass)
    return AssumedInput(
        {"input": "payload", "distribution": "uniform", "low": 0.0, "high": most},
        f"batteries, computers and tools up to {PAYLOAD_SHARE:.0%} of the robot's mass",
    )


def _bumps(robot: Robot) -> AssumedInput:
    most = _short(BUMP_SHARE * leg_length(robot))
    return AssumedInput(
        {"input": "bumps", "distribution": "uniform", "low": 0.0, "high": most},
        f"joints and edges of floors up to {BUMP_SHARE:.0%} of a leg's length",
    )


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")

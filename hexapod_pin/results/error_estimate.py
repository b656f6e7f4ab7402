"""How far a run may be from the exact motion of its scene, sample by sample.

The same case is run twice, the second time finer in everything that limits its steps. What the two
differ by is the error of the coarser one, less that of the finer: errors already made have been
carried along, through contacts and switches, by the motions themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

QUANTITIES = {
    "place": ("m", "the trunk's place, as a length"),
    "turn": ("rad", "the trunk's attitude, as an angle"),
    "joint": ("rad", "any joint angle"),
    "torque": ("N m", "any joint's torque"),
    "foot_force": ("N", "any foot's force, as a length"),
}
"""What errors are estimated of: unit and meaning."""


@dataclass(frozen=True, eq=False)
class ErrorEstimate(Immutable):
    """Estimated error of a run at its samples, the largest from the start to each of them.

    Attributes:
        place: of the trunk's place [m]. Shape (T,).
        turn: of the trunk's attitude [rad]. Shape (T,).
        joint: of any joint angle [rad]. Shape (T,).
        torque: of any joint's torque [N m]; None where torques are not recorded. Shape (T,).
        foot_force: of any foot's force [N]; None where contacts are not recorded. Shape (T,).
    """

    place: Array
    turn: Array
    joint: Array
    torque: Array | None = None
    foot_force: Array | None = None

    def __post_init__(self) -> None:
        """Check shapes and make read-only.

        Raises:
            ParameterError: the arrays differ in length.
        """
        for name, array in self.arrays.items():
            stored = read_only(array)
            if stored.shape != np.shape(self.place):
                raise ParameterError(f"ErrorEstimate.{name}", stored.shape, "as long as `place`")
            object.__setattr__(self, name, stored)

    @property
    def arrays(self) -> dict[str, Array]:
        """The errors by name, those that are known."""
        return {name: e for name in QUANTITIES if (e := getattr(self, name)) is not None}

    @property
    def position(self) -> Array:
        """(T,) [m and rad]: the largest of place, turn and joints."""
        largest: Array = np.maximum(np.maximum(self.place, self.turn), self.joint)
        return largest

    def scaled(self, error_fraction: float) -> ErrorEstimate:
        """Return the errors times a share [-]."""
        return ErrorEstimate(
            **{name: error_fraction * error for name, error in self.arrays.items()}
        )

    @classmethod
    def between(
        cls, run: Mapping[str, Array], companion: Mapping[str, Array], error_fraction: float
    ) -> ErrorEstimate:
        """Return the estimate for a run from a companion of another resolution.

        Args:
            run: samples of the run whose error it is: "q" and, where they are known, "torque" and
                "foot_force", as of `Trace`.
            companion: those of the same case, at the same times.
            error_fraction: of the difference that the error is at most [-].
        """
        q, other = run["q"], companion["q"]
        differences = {
            "place": np.linalg.norm(q[:, :3] - other[:, :3], axis=1),
            "turn": angle_between(q[:, 3:7], other[:, 3:7]),
            "joint": np.abs(q[:, 7:] - other[:, 7:]).max(axis=1, initial=0.0),
        }
        if "torque" in run:
            change = np.abs(run["torque"] - companion["torque"])
            differences["torque"] = change.max(axis=1, initial=0.0)
        if "foot_force" in run:
            length = np.linalg.norm(run["foot_force"] - companion["foot_force"], axis=2)
            differences["foot_force"] = length.max(axis=1, initial=0.0)
        return cls(**{k: error_fraction * np.maximum.accumulate(d) for k, d in differences.items()})


def angle_between(found: Array, expected: Array) -> Array:
    """Return the angle between attitudes, quaternions x y z w (T, 4). Shape (T,) [rad]."""
    a, b = (q / np.linalg.norm(q, axis=1, keepdims=True) for q in (found, expected))
    vector = b[:, 3:] * a[:, :3] - a[:, 3:] * b[:, :3] - np.cross(b[:, :3], a[:, :3])
    scalar = np.einsum("ti,ti->t", a, b)
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=1), np.abs(scalar))
    return angle

"""The state of a run that its future depends on: enough to go on as if it had not stopped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import StateError


@dataclass(frozen=True)
class Checkpoint:
    """Where a run stands.

    Attributes:
        time: [s].
        q: configuration, Pinocchio order (base m and quaternion xyzw, joints rad). Shape (nq,).
        v: velocity (base twist in body axes m/s and rad/s, joints rad/s). Shape (nv,).
        contacts: per contact: touch speed [m/s], stretch of the bristle, world axes [m] (3),
            touching, sliding (0 or 1). Shape (C, 6).
        controller: what an adaptive method's next step depends on; empty where there is none.
    """

    time: float
    q: Array
    v: Array
    contacts: Array
    controller: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Keep read-only copies.

        Raises:
            StateError: a number is not finite.
        """
        for name in ("q", "v", "contacts"):
            array = read_only(getattr(self, name))
            if not np.isfinite(array).all():
                raise StateError(f"Checkpoint.{name} is not finite.")
            object.__setattr__(self, name, array)

    @classmethod
    def from_native(cls, native: Any, sample: float) -> Checkpoint:
        """Return the checkpoint of a native run with samples every `sample` [s]."""
        return cls(
            native.first * sample, native.q, native.v, native.contacts, tuple(native.controller)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON-able form; every digit is kept."""
        return {
            "time": self.time,
            "q": self.q.tolist(),
            "v": self.v.tolist(),
            "contacts": self.contacts.tolist(),
            "controller": list(self.controller),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Checkpoint:
        """Rebuild a checkpoint from its dictionary."""
        contacts = np.array(data["contacts"], dtype=float).reshape(-1, 6)
        return cls(data["time"], data["q"], data["v"], contacts, tuple(data["controller"]))

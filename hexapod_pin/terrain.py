"""The ground the feet stand on."""

from __future__ import annotations

from typing import Any, Literal

from hexapod_pin.spec import Spec


class Flat(Spec):
    """A horizontal plane.

    Attributes:
        height: z of the plane in the world [m].
    """

    kind: Literal["flat"] = "flat"
    height: float = 0.0

    def native(self) -> Any:
        """Return the native ground."""
        import numpy as np

        from hexapod_pin import native as _native

        return _native.plane(np.array([0.0, 0.0, self.height]), np.array([0.0, 0.0, 1.0]))

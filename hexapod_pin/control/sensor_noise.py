"""Random errors that depend on their place alone, so that no run has to remember them.

Philox4x64-10 [Salmon2011] is a counter-based generator: key (seed, case), counter (position,
quantity, purpose, 0). A component of a tick has its fixed position, so that any part can be drawn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.sensors import Sensor

BLOCK_TICKS = 128
"""Ticks drawn at once, a multiple of 4: a Philox counter yields 4 words."""

GROUP_ROWS = 16
"""Rows drawn at once: their intermediate results fit a core's cache."""

NOISE, OFFSET = 0, 1
"""Purposes of a stream."""


class SensorErrors:
    """Noise plus offset of one quantity in B runs, drawn block by block.

    Attributes:
        sensor: standard deviations, in the unit of the quantity.
        seed: of all errors.
        case_numbers: (B,).
        quantity: number of the quantity, which has its own streams.
    """

    def __init__(
        self, sensor: Sensor, seed: int, case_numbers: tuple[int, ...], quantity: int
    ) -> None:
        """Draw nothing yet."""
        self.sensor, self.seed = sensor, seed
        self.case_numbers, self.quantity = case_numbers, quantity

    def block(self, tick: int) -> int:
        """Return the number of the block that holds a tick; all ticks are in one without noise."""
        return tick // BLOCK_TICKS if self.sensor.noise > 0.0 else 0

    def draw(self, block: int, components: int) -> Array:
        """Return the errors of a block, (ticks, B, components); of one tick if all are alike."""
        offset = np.zeros((1, len(self.case_numbers), components))
        if self.sensor.bias > 0.0:
            self._add_normals(offset, self.sensor.bias, OFFSET, 0)
        if self.sensor.noise == 0.0:
            return offset
        errors = np.repeat(offset, BLOCK_TICKS, axis=0)
        self._add_normals(errors, self.sensor.noise, NOISE, block * BLOCK_TICKS)
        return errors

    def _add_normals(self, errors: Array, deviation: float, purpose: int, start: int) -> None:
        """Add normal numbers to errors (ticks, B, components) that begin at tick `start`."""
        ticks, batch, components = errors.shape
        words = (components + 1) // 2  # per tick
        stream = np.random.Philox(key=0)
        state = stream.state
        for first in range(0, batch, GROUP_ROWS):
            group = slice(first, first + GROUP_ROWS)
            cases = self.case_numbers[group]
            raw = np.empty((ticks, len(cases), words), np.uint64)
            for row, case in enumerate(cases):
                state["state"]["key"][:] = self.seed, case
                state["state"]["counter"][:] = start * words // 4, self.quantity, purpose, 0
                stream.state = state
                raw[:, row] = stream.random_raw(ticks * words).reshape(ticks, words)
            errors[:, group] += deviation * box_muller(raw)[..., :components]


def box_muller(words: NDArray[np.uint64]) -> Array:
    """Return standard normal numbers (..., 2 n) from random 64-bit words (..., n).

    sqrt(-2 log u1) (cos, sin)(2 pi u2) [BoxMuller1958], u1 from the upper half of a word and u2
    from the lower. In single precision (24 bits, at most 6.8), which costs a third of NumPy's
    normal numbers.
    """
    unit = np.float32(2.0**-32)
    high, low = ((words >> np.uint64(shift)).astype(np.uint32) for shift in (32, 0))
    radius = high.astype(np.float32) * unit
    radius += np.float32(0.5) * unit  # u1, in (0, 1]
    np.log(radius, out=radius)
    radius *= np.float32(-2.0)
    np.sqrt(radius, out=radius)
    angle = low.astype(np.float32) * (np.float32(2.0 * np.pi) * unit)
    n = words.shape[-1]
    normals = np.empty((*words.shape[:-1], 2 * n))
    np.multiply(radius, np.cos(angle), out=normals[..., :n])
    np.multiply(radius, np.sin(angle), out=normals[..., n:])
    return normals

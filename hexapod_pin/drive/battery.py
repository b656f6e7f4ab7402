"""A battery: voltage by its charge, and what its resistance takes of it under a current."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

AMPERE_HOUR = 3600.0
"""In coulomb."""

LITHIUM_CURVE = (
    (0.0, 3.27), (0.05, 3.61), (0.1, 3.69), (0.2, 3.73), (0.3, 3.77), (0.4, 3.80), (0.5, 3.84),
    (0.6, 3.87), (0.7, 3.95), (0.8, 4.02), (0.9, 4.11), (1.0, 4.20),
)  # fmt: skip
"""Open-circuit voltage of a lithium-polymer cell by its charge [-, V]: the table that packs for
models are commonly sold with, *assumed*."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Battery(Spec):
    """A battery with its leads: U = U_open(charge) - resistance I, all motors on the same bus.

    Attributes:
        voltage: open circuit, fully charged [V].
        resistance: internal, with the leads [ohm].
        capacity: charge from full to empty [A h]; None: its voltage does not fall with use.
        standby_current: of all electronics together [A].
        charge: share of the capacity with which a run begins [-].
        curve: pairs of charge and open-circuit voltage over `voltage` [-, -], increasing in charge
            from 0 to 1; linear between them. None: the voltage does not depend on the charge.
        regeneration: whether currents that braking motors give back feed the others and the
            battery; else they are lost in the drives.
    """

    voltage: PositiveFloat
    resistance: NonNegativeFloat = 0.0
    capacity: PositiveFloat | None = None
    standby_current: NonNegativeFloat = 0.0
    charge: Share = 1.0
    curve: tuple[tuple[Share, PositiveFloat], ...] | None = None
    regeneration: bool = False

    @field_validator("curve", mode="after")
    @classmethod
    def _ordered(
        cls, value: tuple[tuple[float, float], ...] | None
    ) -> tuple[tuple[float, float], ...] | None:
        if value is None:
            return None
        shares = [share for share, _ in value]
        steps = np.diff(shares)
        if len(shares) < 2 or shares[0] != 0.0 or shares[-1] != 1.0 or not (steps > 0.0).all():
            raise ParameterError("Battery.curve", value, "increasing in charge from 0 to 1")
        if not (np.diff([part for _, part in value]) >= 0.0).all() or value[-1][1] != 1.0:
            allowed = "shares of `voltage` that do not fall with the charge, up to 1"
            raise ParameterError("Battery.curve", value, allowed)
        return value

    @classmethod
    def lithium(
        cls, cells: int, capacity: float, resistance: float, *, standby_current: float = 0.0,
        charge: float = 1.0, regeneration: bool = False,
    ) -> Battery:  # fmt: skip
        """Return a pack of lithium-polymer cells in series, with their usual curve (*assumed*).

        Args:
            cells: in series, 1 to 24 [-].
            capacity: of the pack [A h].
            resistance: of the pack and its leads [ohm].
            standby_current: of all electronics together [A].
            charge: with which a run begins [-].
            regeneration: as of `Battery`.

        Raises:
            ParameterError: a number out of range.
        """
        if not 1 <= cells <= 24:
            raise ParameterError("Battery.lithium.cells", cells, "from 1 to 24")
        full = LITHIUM_CURVE[-1][1]
        return cls(
            voltage=cells * full, resistance=resistance, capacity=capacity,
            standby_current=standby_current, charge=charge, regeneration=regeneration,
            curve=tuple((share, cell / full) for share, cell in LITHIUM_CURVE),
        )  # fmt: skip

    @checked
    def open_voltage(self, drawn: Array | float = 0.0) -> Array:
        """Return the open-circuit voltage after a charge has been drawn [V]. Shape of the argument.

        Args:
            drawn: since the start of the run, below 0 where more came back [C]. An empty battery
                keeps the curve's last voltage.
        """
        drawn = np.asarray(drawn, dtype=float)
        if self.curve is None:
            return np.full(drawn.shape, self.voltage)
        used = drawn / (AMPERE_HOUR * self.capacity) if self.capacity else np.zeros_like(drawn)
        shares, parts = np.array(self.curve).T
        found: Array = self.voltage * np.interp(self.charge - used, shares, parts)
        return found

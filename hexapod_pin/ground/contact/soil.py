r"""Soils by Bekker's pressure-sinkage relation, and what a spherical foot feels on them.

Bekker (1969): a plate of smaller half-width b that has sunk by z is pushed up with the pressure
p = (k_c/b + k_phi) z^n. Under a sphere of radius R that has sunk by d the local sinkage at distance
r from the axis is z = d - R + sqrt(R^2 - r^2), and b is the radius of the contact circle,
a = sqrt(2 R d - d^2), at most R. With r dr = -(R - d + z) dz the upright part of the pressure is

    F = 2 pi k \int_e^d z^n (R - d + z) dz,   k = k_c/a + k_phi,   e = max(0, d - R)

where for d > R the foot goes on as a cylinder of radius R. For d << R and k_c = 0 it is the power
law F = 2 pi k_phi R/(n + 1) d^(n + 1). Feet of legged robots are treated so by Ding et al. (2013).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

from pydantic import Field

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.spec import Spec

Angle = Annotated[float, Field(gt=0.0, lt=0.5 * math.pi)]

Exponent = Annotated[float, Field(gt=0.0, le=10.0)]
Cohesive = Annotated[float, Field(ge=0.0, le=1e15)]
Frictional = Annotated[float, Field(ge=1e-3, le=1e15)]

SINKAGE_BISECTIONS = 200

RANGES = {"radius": (1e-6, 1e3, "m"), "load": (1e-9, 1e9, "N"), "depth": (-1e6, 1e6, "m")}
"""What is computed with neither overflow nor underflow, for any soil."""

NOTHING = 1e-60
"""Depth below which no soil resists [m]."""


class Soil(Spec):
    """A soil's constants for normal load, SI.

    Attributes:
        exponent: n [-].
        cohesive_modulus: k_c [N/m^(n+1)].
        frictional_modulus: k_phi [N/m^(n+2)].
        friction_angle: phi, of internal friction [rad].
        source: where the numbers are from.
    """

    exponent: Exponent
    cohesive_modulus: Cohesive = 0.0
    frictional_modulus: Frictional
    friction_angle: Angle
    source: str = ""

    def force(self, depth: float, radius: float) -> float:
        """Return the force on a sphere of some radius [m] at a depth [m], nothing moving [N].

        Raises:
            ParameterError: depth or radius is out of `RANGES`.
        """
        _require(depth=depth, radius=radius)
        return self._force_and_slope(depth, radius)[0] if depth > NOTHING else 0.0

    def sinkage(self, load: float, radius: float) -> float:
        """Return the depth at which a sphere of some radius [m] carries a load [N] at rest [m].

        Raises:
            ParameterError: load or radius is out of `RANGES`, or it sinks for ever.
        """
        _require(radius=radius, load=load)
        low, high = 0.0, radius
        while self.force(high, radius) < load:
            low, high = high, 2.0 * high
        for _ in range(SINKAGE_BISECTIONS):
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            low, high = (middle, high) if self.force(middle, radius) < load else (low, middle)
        return high

    def power_law(self, radius: float, load: float | None = None) -> tuple[float, float]:
        """Return K [N/m^m] and m of the law K d^m next to this soil under a sphere.

        Args:
            radius: of the sphere [m].
            load: at which force and slope are those of the soil [N]; None: the limit of small
                depths, which is a power of the depth only without cohesive modulus.

        Raises:
            ParameterError: a value is out of `RANGES`, `load` is missing, or it sinks the
                foot so deep that the force rises less than in proportion.
        """
        if load is None:
            _require(radius=radius)
            if self.cohesive_modulus > 0.0:
                raise ParameterError("load", None, "given for a soil with a cohesive modulus [N]")
            power = self.exponent + 1.0
            return 2.0 * math.pi * self.frictional_modulus * radius / power, power
        depth = self.sinkage(load, radius)
        force, slope = self._force_and_slope(depth, radius)
        power = depth * slope / force
        if power < 1.0:
            raise ParameterError(
                "load", load, "less: the foot sinks too deep for a contact law",
                f"It sinks by {depth:.3g} m with a radius of {radius:g} m; use a larger foot.",
            )  # fmt: skip
        return force / depth**power, power

    def _force_and_slope(self, depth: float, radius: float) -> tuple[float, float]:
        """Return force [N] and its derivative to the depth [N/m], depth above 0."""
        n, over = self.exponent, max(0.0, depth - radius)
        inside = min(depth, radius)
        width = math.sqrt(inside * (2.0 * radius - inside))
        modulus = self.cohesive_modulus / width + self.frictional_modulus
        softening = -self.cohesive_modulus * (radius - inside) / width**3
        first = (depth ** (n + 1.0) - over ** (n + 1.0)) / (n + 1.0)
        second = (depth ** (n + 2.0) - over ** (n + 2.0)) / (n + 2.0)
        volume = (radius - depth) * first + second
        slope = radius * depth**n - first
        two_pi = 2.0 * math.pi
        return two_pi * modulus * volume, two_pi * (modulus * slope + softening * volume)


def _require(**values: float) -> None:
    for name, value in values.items():
        least, most, unit = RANGES[name]
        if not least <= value <= most:
            raise ParameterError(name, value, f"from {least:g} to {most:g} {unit}")


_WONG = "table of Wong, Theory of Ground Vehicles, as public vehicle simulations quote it"

SOILS: Mapping[str, Soil] = MappingProxyType(
    {
        "sand": Soil(
            exponent=0.793, cohesive_modulus=102e3, frictional_modulus=5301e3,
            friction_angle=math.radians(31.1), source=f"LETE sand; {_WONG}",
        ),
        "loose-sand": Soil(
            exponent=1.1, cohesive_modulus=0.99e3, frictional_modulus=1528.43e3,
            friction_angle=math.radians(28.0), source=f"dry sand of the LLL; {_WONG}",
        ),
        "clay": Soil(
            exponent=0.5, cohesive_modulus=13.19e3, frictional_modulus=692.15e3,
            friction_angle=math.radians(13.0), source=f"clayey soil, Thailand; {_WONG}",
        ),
    }
)  # fmt: skip
"""Soils by name. Plates of the measurements are much wider than feet: *assumed* to hold."""


def soil_named(name: str) -> Soil:
    """Return one of SOILS.

    Raises:
        UnknownNameError: there is no such soil.
    """
    if name not in SOILS:
        raise UnknownNameError("soil", name, list(SOILS))
    return SOILS[name]

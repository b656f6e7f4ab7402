"""S1's virtual suspension: a leg yields to its load as if it stood on a spring and a damper."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from pydantic import PositiveFloat, field_validator, model_serializer

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler

DELAYS_PER_PERIOD = 0.05
"""Frequency times delay of a suspension whose frequency is not given (*assumed*)."""

LEAST_DELAY = 7.5e-3
"""What a shorter delay counts as there: contacts bear no quicker legs [s] (*assumed*)."""


class VirtualSuspension(Spec):
    """Admittance along the normal of the support, m z'' + c z' + k z = f - f0, z the retraction.

    S1 prints no equations or gains; these are of mass-spring-damper form with m = k / w^2 and
    c = 2 zeta k / w, w = 2 pi frequency. The nominal load f0 is the share of the weight that the
    standing feet bear (balance of force and moments, least squares), or a constant.

    Attributes:
        stiffness: k [N/m]; None: retracts by `travel` under a sixth of the weight.
        travel: [m]. The default is *assumed*.
        frequency: of the undamped mass on its spring [Hz]; None: 1 / (20 d), d the delay of the
            loop, 7.5 ms at least (*assumed*: standing robots shake from 1.4 times that on).
        damping: zeta, 1 is critical [-]. The default is *assumed*.
        load: "split" of the weight, or the same for every standing foot [N].
        limit: largest travel either way [m]. *Assumed*.
    """

    kind: Literal["virtual-suspension"] = "virtual-suspension"
    stiffness: PositiveFloat | None = None
    travel: PositiveFloat = 0.002
    frequency: PositiveFloat | None = None
    damping: PositiveFloat = 1.6
    load: Literal["split"] | PositiveFloat = "split"
    limit: PositiveFloat = 0.03

    @field_validator("load", mode="before")
    @classmethod
    def _split_or_force(cls, value: Any) -> Any:
        """Name what is allowed as a whole, not as its first half."""
        if value == "split" or (isinstance(value, int | float) and 0.0 < value < math.inf):
            return value
        raise ParameterError("VirtualSuspension.load", value, '"split", or a force above 0 N')

    def resolved(self, weight: float, delay: float) -> tuple[float, float]:
        """Return stiffness [N/m] and frequency [Hz] for a weight [N] and a loop's delay [s]."""
        stiffness = weight / (6.0 * self.travel) if self.stiffness is None else self.stiffness
        own = DELAYS_PER_PERIOD / max(delay, LEAST_DELAY)
        frequency = own if self.frequency is None else self.frequency
        return stiffness, frequency

    def gains(self, weight: float, delay: float) -> tuple[float, float, float]:
        """Return m [kg], c [N s/m] and k [N/m]; arguments as of `resolved`."""
        stiffness, frequency = self.resolved(weight, delay)
        rate = 2.0 * math.pi * frequency
        return stiffness / rate**2, 2.0 * self.damping * stiffness / rate, stiffness

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

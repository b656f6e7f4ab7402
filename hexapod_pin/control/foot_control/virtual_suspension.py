"""S1's virtual suspension: a leg that yields to its load as if it stood on a spring and a damper."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from pydantic import PositiveFloat, model_serializer

from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler


class VirtualSuspension(Spec):
    """Admittance along the normal of the support, m z'' + c z' + k z = f - f0, z the retraction.

    S1 prints no equations or gains; these are of mass-spring-damper form with m = k / w^2 and
    c = 2 zeta k / w, w = 2 pi frequency. The nominal load f0 is the share of the weight that the
    standing feet bear (balance of force and moments, least squares), or a constant.

    Attributes:
        stiffness: k [N/m]; None: retracts by `travel` under a sixth of the weight.
        travel: [m]. The default is *assumed*.
        frequency: of the undamped mass on its spring [Hz]. The default is *assumed*.
        damping: zeta, 1 is critical [-]. The default is *assumed*.
        load: "split" of the weight, or the same for every standing foot [N].
        limit: largest travel either way [m]. *Assumed*.
    """

    kind: Literal["virtual-suspension"] = "virtual-suspension"
    stiffness: PositiveFloat | None = None
    travel: PositiveFloat = 0.002
    frequency: PositiveFloat = 8.0
    damping: PositiveFloat = 1.6
    load: Literal["split"] | PositiveFloat = "split"
    limit: PositiveFloat = 0.03

    @property
    def rate(self) -> float:
        """Of the undamped mass on its spring [rad/s]."""
        return 2.0 * math.pi * self.frequency

    def gains(self, weight: float) -> tuple[float, float, float]:
        """Return m [kg], c [N s/m] and k [N/m] for a robot's weight [N]."""
        stiffness = weight / (6.0 * self.travel) if self.stiffness is None else self.stiffness
        damping = 2.0 * self.damping * stiffness / self.rate
        return stiffness / self.rate**2, damping, stiffness

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

"""S1's virtual suspension: a leg that yields to its load as if it stood on a spring and a damper."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import PositiveFloat

from hexapod_pin.spec import Spec


class VirtualSuspension(Spec):
    """Admittance along the normal of the support, m z'' + c z' + k z = f - f0, z the retraction.

    S1 prints no equations or gains; these are of mass-spring-damper form with m = k / w^2 and
    c = 2 zeta k / w, w = 2 pi frequency. The nominal load f0 is the share of the weight that the
    standing feet bear (balance of force and moments, least squares), or a constant.

    Attributes:
        stiffness: k [N/m]. The default retracts 3 mm under 7.6 N (*assumed*).
        frequency: of the undamped mass on its spring [Hz]. The default is *assumed*.
        damping: zeta, 1 is critical [-]. The default is *assumed*.
        load: "split" of the weight, or the same for every standing foot [N].
        load_time: in which a foot takes up its share, and gives it back before it lifts [s].
            *Assumed*.
        limit: largest travel either way [m]. *Assumed*.
    """

    kind: Literal["virtual-suspension"] = "virtual-suspension"
    stiffness: PositiveFloat = 2.5e3
    frequency: PositiveFloat = 4.0
    damping: PositiveFloat = 0.8
    load: Literal["split"] | PositiveFloat = "split"
    load_time: PositiveFloat = 0.1
    limit: PositiveFloat = 0.03

    @property
    def rate(self) -> float:
        """w [rad/s]."""
        return 2.0 * math.pi * self.frequency

    @property
    def mass(self) -> float:
        """m [kg]."""
        return self.stiffness / self.rate**2

    @property
    def damper(self) -> float:
        """c [N s/m]."""
        return 2.0 * self.damping * self.stiffness / self.rate

"""A contact: a normal law with a friction law, and the pairs with names."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, cast

from pydantic import Field

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.ground.contact.friction import (
    AdamsCoulomb,
    BrownMcPhee,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.contact.normal import (
    AdamsImpact,
    HuntCrossley,
    KelvinVoigt,
    hertz_stiffness,
)
from hexapod_pin.ground.contact.restitution import Restitution
from hexapod_pin.ground.contact.soil import soil_named
from hexapod_pin.plugins import CONTACTS, plugin_names, plugin_result
from hexapod_pin.spec import Spec

RUBBER = hertz_stiffness(young=5e6, poisson=0.49, radius=0.020)
"""Hertz' K of the *assumed* rubber foot, 1.24e6 N/m^1.5: E 5 MPa, nu 0.49, R 20 mm."""


class Contact(Spec):
    """What a foot feels: a normal law and a friction law.

    Attributes:
        normal: HuntCrossley, Restitution, KelvinVoigt or AdamsImpact.
        friction: StickSlip, TanhCoulomb, SmoothStep, BrownMcPhee or AdamsCoulomb.
        assumed: a text on the numbers that no source gives; empty for a user's own.
    """

    normal: Annotated[
        HuntCrossley | Restitution | KelvinVoigt | AdamsImpact, Field(discriminator="kind")
    ]
    friction: Annotated[
        StickSlip | TanhCoulomb | SmoothStep | BrownMcPhee | AdamsCoulomb,
        Field(discriminator="kind"),
    ]
    assumed: str = ""

    def describe(self) -> str:
        """Return the kinds of both laws, as text."""
        return f"{self.normal.kind} with {self.friction.kind}"

    @classmethod
    def accurate(cls) -> Contact:
        """Hertz with the requested restitution, and friction that does not creep.

        All numbers are *assumed*: rubber E 5 MPa, nu 0.49, R 20 mm; e = 0.3; mu 0.7; tangential
        stiffness 2e4 N/m, near Mindlin's 2 (1 - nu)/(2 - nu) = 0.68 of the Hertz stiffness under
        7.6 N (3.4e4 N/m); 60 N s/m, 0.7 of critical for 0.1 kg at the foot.
        """
        return cls(
            normal=Restitution(stiffness=RUBBER, restitution=0.3),
            friction=StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
            assumed="no source gives contact numbers: rubber foot E 5 MPa, nu 0.49, R 20 mm, "
            "restitution 0.3, mu 0.7, tangential 2e4 N/m and 60 N s/m",
        )

    @classmethod
    def s1(cls) -> Contact:
        """S1's laws, eq. 4 with Hertz' exponent restored. S1 prints no numbers: all are *assumed*.

        E = 5 MPa, nu = 0.49, R = 20 mm; dissipation 20 s/m gives a restitution of 0.3 at 0.1 m/s.
        """
        return cls(
            normal=HuntCrossley(stiffness=RUBBER, dissipation=20.0),
            friction=TanhCoulomb(mu=0.7, slope=1e3),
            assumed="S1 prints no contact numbers: rubber foot E 5 MPa, nu 0.49, R 20 mm, "
            "dissipation 20 s/m, mu 0.7, kt 1000 s/m",
        )

    @classmethod
    def s1_printed(cls) -> Contact:
        """S1's laws with eq. 4 as printed, linear in the depth (n = 1). All numbers are *assumed*.

        K = 2.75e4 N/m has the depth of `s1`, 0.49 mm, under 13.5 N (S1's robot on six feet).
        """
        return cls(
            normal=HuntCrossley(stiffness=2.75e4, exponent=1.0, dissipation=20.0),
            friction=TanhCoulomb(mu=0.7, slope=1e3),
            assumed="S1 prints no contact numbers: linear stiffness 2.75e4 N/m, "
            "dissipation 20 s/m, mu 0.7, kt 1000 s/m",
        )

    @classmethod
    def s2(cls) -> Contact:
        """S2's numbers (figure 4): K 1e5 N/mm^2.2, c 10 N s/mm at 0.1 mm; mu 0.3/0.1 at 0.1/1 m/s.

        They look like untouched ADAMS defaults: a regression set, not a measured foot.
        """
        return cls(
            normal=AdamsImpact.from_mm(
                stiffness=1e5, exponent=2.2, damping=10.0, damping_depth=0.1
            ),
            friction=AdamsCoulomb(
                mu_static=0.3, mu_dynamic=0.1, stiction_speed=0.1, transition_speed=1.0
            ),
        )

    @classmethod
    def soil(cls, name: str = "sand", *, radius: float = 0.020, load: float = 10.0) -> Contact:
        """A foot on soil (S1's further work): Bekker's sinkage, next to no rebound, mu = tan phi.

        The soil's constants are measured; radius, load, dissipation 100 s/m and the tangential
        spring of `accurate` are *assumed*. Left out: cohesion, how shear builds up,
        and footprints that stay.

        Args:
            name: one of `SOILS`: "sand", "loose-sand", "clay".
            radius: of the foot [m].
            load: on the foot, at which force and slope are those of the soil [N].

        Raises:
            UnknownNameError: there is no such soil.
            ParameterError: radius or load is out of range.
        """
        soil = soil_named(name)
        return cls(
            normal=HuntCrossley.soil(soil, radius=radius, load=load),
            friction=StickSlip(mu=math.tan(soil.friction_angle), stiffness=2e4, damping=60.0),
            assumed=f"{soil.source}; foot R {1e3 * radius:g} mm under {load:g} N, "
            "dissipation 100 s/m, tangential 2e4 N/m and 60 N s/m",
        )

    def with_mu(self, mu: float | None) -> Contact:
        """Return the same laws with another friction coefficient; None changes nothing.

        Args:
            mu: friction coefficient [-]; the static one, where the dynamic one keeps its ratio.

        Raises:
            ParameterError: mu is out of range.
        """
        if mu is None:
            return self
        note = f"{self.assumed}; but mu {mu:g} as given" if self.assumed else ""
        return Contact(normal=self.normal, friction=self.friction.with_mu(mu), assumed=note)

    def stiffer(self, factor: float) -> Contact:
        """Return the contact of a foot `factor` times as stiff in all directions.

        Normal stiffness and the spring of `StickSlip` take the factor, as of a foot whose modulus
        does; restitution, damping ratio and friction coefficients stay.

        Raises:
            ParameterError: the factor is not positive and finite.
        """
        note = f"{self.assumed}; but {factor:g} times as stiff" if self.assumed else ""
        normal, friction = self.normal.stiffer(factor), self.friction.stiffer(factor)
        return Contact(normal=normal, friction=friction, assumed=note)

    @classmethod
    def preset(cls, name: str) -> Contact:
        """Return the contact of one of the names in `PRESETS`, or one of an installed package.

        Raises:
            UnknownNameError: for another name.
            UserCodeError: the package that has the contact cannot be loaded.
        """
        if name in PRESETS:
            return PRESETS[name]()
        found = plugin_result(CONTACTS, name, Contact)
        if found is None:
            raise UnknownNameError("contact preset", name, preset_names(name))
        return cast("Contact", found)


PRESETS: dict[str, Callable[[], Contact]] = {
    "accurate": Contact.accurate,
    "s1": Contact.s1,
    "s1-printed": Contact.s1_printed,
    "s2": Contact.s2,
    "soil": Contact.soil,
}
"""The named contacts."""


def read_contact(data: Mapping[str, Any]) -> Contact:
    """Return the contact of a scene's text: its laws, or the name of one as `preset`.

    Raises:
        ParameterError: a law is missing, or a value is out of range.
        UnknownNameError, UserCodeError: as `Contact.preset`.
    """
    if set(data) == {"preset"}:
        return Contact.preset(data["preset"])
    return Contact(**data)


def preset_names(wanted: str) -> list[str]:
    """Return the names of contacts, those of installed packages only where none else is wanted."""
    return list(PRESETS) if wanted in PRESETS else [*PRESETS, *plugin_names(CONTACTS)]

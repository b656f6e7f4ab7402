"""What is absurd about a robot as a whole: its mass, its size, the units of its numbers."""

from __future__ import annotations

from collections.abc import Iterator

from hexapod_pin.robot.mending import rules
from hexapod_pin.robot.mending.finding import Finding
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.units import (
    UnitSlip,
    inertia_slip,
    joint_length_slip,
    length_slips,
    mass_slip,
    mesh_slips,
)

SCALE_FIRST = "scale the lengths first: nothing tells what fits a robot of such a size"
"""Way out for what needs a robot of a possible size to be repaired."""


def whole_findings(measures: Measures) -> list[Finding]:
    """Return every trouble of the robot as a whole; nothing of files without moved joints."""
    slips = [joint_length_slip(measures), mass_slip(measures), inertia_slip(measures)]
    slips += [*length_slips(measures), *mesh_slips(measures).values()]
    sized = measures.plausible_size or slips[0] is not None
    found = [_slip(slip, sized) for slip in slips if slip is not None]
    kinds = {slip.kind for slip in slips if slip is not None}
    if "joints" not in kinds:
        found += _size(measures)
        if "masses" not in kinds and measures.plausible_size:
            found += _mass(measures)
    return found


def _slip(slip: UnitSlip, sized: bool) -> Finding:
    """Return a finding; masses and inertias are scaled where the size of the robot is possible."""
    repairable = sized or slip.kind not in ("masses", "inertias")
    si = {"masses": "kg", "inertias": "kg m^2"}.get(slip.kind, "m")
    return Finding(
        f"{slip.kind} in {slip.unit}",
        "robot",
        slip.value,
        f"in {si}",
        f"all multiplied by {slip.factor:g}" if repairable else SCALE_FIRST,
        "suspicious",
        repairable=repairable,
    )


def _size(measures: Measures) -> Iterator[Finding]:
    span, (low, high) = measures.span, rules.SPAN
    if span > 0.0 and not low <= span <= high:
        yield Finding(
            "absurd size",
            "robot",
            f"joints span {span:.3g} m",
            f"{low:g} to {high:g} m is plausible",
            "no unit explains it; scale the lengths",
            "suspicious",
            repairable=False,
        )


def _mass(measures: Measures) -> Iterator[Finding]:
    span, total, (low, high) = measures.span, measures.total_mass, rules.MASS_PER_SPAN
    if span <= 0.0 or total <= 0.0 or low <= total / span**3 <= high:
        return
    light = total < low * span**3
    mend = (
        "from the links' solids and --density, or --mass"
        if light
        else "give --mass, which scales all masses and inertias"
    )
    yield Finding(
        "absurd mass",
        "robot",
        f"{grams(total)} on a span of {span:.3g} m",
        f"{grams(low * span**3)} to {grams(high * span**3)} is plausible",
        mend,
        "suspicious",
        repairable=light,
    )


def grams(mass: float) -> str:
    """Return a mass with its unit, in grams below 10 g."""
    return f"{mass * 1e3:.3g} g" if mass < 0.01 else f"{mass:.4g} kg"

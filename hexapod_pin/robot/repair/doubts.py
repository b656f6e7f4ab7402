"""What in an accepted URDF makes its torques doubtful, in short phrases.

A file is accepted with inertias in the wrong unit, masses that no body has, or lengths that nothing
explains. Its torques are computed rightly, but of a robot that does not exist.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.finding import Finding

UNITS = ("joints", "meshes", "inertials", "masses", "inertias", "limits", "angles", "spheres")
"""Numbers of which a finding "... in UNIT" tells the unit; of shapes only pictures depend on it."""

WORDS = {"joints": "lengths", "spheres": "radii of spheres"}
"""What numbers are called in a doubt: those of the joints are the robot's lengths."""

WHOLE = ("absurd mass", "absurd size")
"""Kinds of finding of the whole robot."""

IN_ROBOT_FRAME = "centres of mass in the robot's frame"
OFF_HIPS = "trunk off its hips"
SAME_INERTIA = "one inertia for all links"
SAME_MASS = "one mass for all links"
NARROW = "narrow limits"
LIGHT_LEGS = "legs without motors"
"""Kinds of finding of all links or joints together."""

OF_ALL = {
    IN_ROBOT_FRAME: "centres of mass look like those in the robot's frame, not in the links'",
    OFF_HIPS: "the trunk's centre of mass lies {value}",
    SAME_INERTIA: "inertias are a placeholder, {value}",
    SAME_MASS: "masses are a placeholder, {value}",
    LIGHT_LEGS: "legs weigh {value}",
    NARROW: "limits look like radians read as degrees: {value}",
}
"""Phrases of these."""

UNLIKE, TWICE = "unlike the other legs", "body that counts twice"
"""Kinds of finding of one part."""

RESISTANCE = "absurd resistance"
"""Kind of finding of joints that resist, all together."""

OF_PARTS = (UNLIKE, TWICE)
"""Kinds of which the place and the value are named."""

OF_LINKS = {
    "inertia against size": "inertia that does not fit the size",
    "dummy mass": "lighter than air",
    "too dense": "denser than any metal",
    "centre of mass outside": "centre of mass outside the body",
}
"""Phrases by kind of finding of a link."""


def doubts(findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return why torques of an accepted file may be wrong, a phrase each; mostly nothing.

    Args:
        findings: of the file, as of `find_all`.
    """
    found = []
    for finding in findings:
        numbers, joined, unit = finding.what.partition(" in ")
        if joined and numbers in UNITS:
            found.append(f"{WORDS.get(numbers, numbers)} look like {unit}, not SI units")
        elif finding.what in WHOLE:
            found.append(f"{finding.what}: {finding.value}")
        elif finding.what in OF_ALL:
            found.append(OF_ALL[finding.what].format(value=finding.value))
    found += [
        f"{name_of(finding.where)}: {finding.value}"
        for finding in findings
        if finding.what in OF_PARTS and not finding.value.startswith("velocity")
    ]
    known = {finding.where for finding in findings if finding.what in OF_PARTS}
    resisting = [x for x in findings if x.what == RESISTANCE and x.where not in known]
    if resisting:
        first, more = resisting[0], len(resisting) - 1
        found.append(f"{name_of(first.where)}{f' and {more} more' if more else ''}: {first.value}")
    links = Counter(finding.what for finding in findings if finding.what in OF_LINKS)
    if any(text.startswith("inertias") for text in found):
        links.pop("inertia against size", None)
    if any(text.startswith("centres of mass") for text in found):
        links.pop("centre of mass outside", None)
    places = {finding.what: finding.where for finding in findings}
    for kind, count in links.items():
        found.append(f"{OF_LINKS[kind]}: {places[kind] if count == 1 else f'{count} links'}")
    return tuple(found)


def name_of(place: str) -> str:
    """Return the name in a place such as "link 'tibia_1'"."""
    return place.partition(" ")[2].strip("'") or place


# The mass of the whole robot, from the length of its legs and the motors that it must carry.


def plausible_mass(leg: float, motors: int) -> tuple[float, float]:
    """Return between which masses walking robots are [kg].

    Args:
        leg: length of the longest leg, stretched, from its first joint to its foot [m].
        motors: that move the legs.
    """
    (low, high), (least, small) = rules.MASS_PER_LEG, rules.MOTOR_MASS
    return max(low * leg**3, least * motors), high * leg**3 + small * motors


def mass_doubts(total: float, leg: float, motors: int) -> tuple[str, ...]:
    """Return why a robot's mass is none that such a robot has; mostly nothing.

    Args:
        total: mass of the robot [kg].
        leg: length of its longest leg [m].
        motors: that move its legs.
    """
    low, high = plausible_mass(leg, motors)
    if leg <= 0.0 or motors == 0 or low <= total <= high:
        return ()
    return (
        f"{MASS}{grams(total)}, {grams(low)} to {grams(high)} is plausible for legs of "
        f"{leg:.2g} m and {motors} motors",
    )


MASS = "mass "
"""How the doubt about a robot's mass begins."""


def grams(mass: float) -> str:
    """Return a mass with its unit, in grams below 10 g."""
    return f"{mass * 1e3:.3g} g" if mass < 0.01 else f"{mass:.3g} kg"

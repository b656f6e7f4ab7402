"""Faults of masses, and of the robot's size as a whole, are found, and masses are repaired."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np

from hexapod_pin.robot.description.solids import bodies, finite
from hexapod_pin.robot.description.urdf_file import Link
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.doubts import (
    IN_ROBOT_FRAME,
    OFF_HIPS,
    SAME_MASS,
    TWICE,
    grams,
    plausible_mass,
)
from hexapod_pin.robot.repair.finding import Draft, Finding, number, scaled
from hexapod_pin.robot.repair.inertias import dummy, impossible_mass, write_inertial
from hexapod_pin.robot.repair.measures import Measures, Solid, two_digits
from hexapod_pin.robot.repair.structure import trunk_links, trunk_root
from hexapod_pin.robot.repair.units import (
    UnitSlip,
    angle_slip,
    inertia_slip,
    joint_length_slip,
    length_slips,
    mass_slip,
    mesh_slips,
    readable,
    uniform_mass,
)
from hexapod_pin.robot.rotations import roll_pitch_yaw, rotation


@dataclass(frozen=True)
class Shares:
    """How links without a mass get one.

    Attributes:
        drawn: links with a body that is drawn, or lies between joints, and that body.
        bare: moved links of which nothing is known.
        density: of the bodies [kg/m^3].
        bare_mass: of each bare link [kg].
    """

    drawn: tuple[tuple[Link, Solid], ...]
    bare: tuple[Link, ...]
    density: float
    bare_mass: float


def repair_masses(draft: Draft) -> None:
    """Bring masses to kilograms, drop dummies, and give every moved body a mass."""
    _repair_frame(draft)
    slip = mass_slip(draft.measures)
    if slip is not None:
        for mass in draft.root.findall("link/inertial/mass"):
            mass.set("value", scaled(mass.get("value") or "", -3))
        text = f"all masses multiplied by {slip.factor:g}: {slip.value}"
        draft.change("robot", text, f"masses were in {slip.unit}")
    for link in draft.file.links:
        if written := impossible_mass(link):
            _drop_inertial(draft, link, f"its mass {written} is none")
    _drop_dummies(draft)
    if draft.options.mass is None and heavy(draft.measures):
        usual = usual_mass(draft.measures)
        _scale_to(draft, usual, "heavier than anything of that size; the usual mass is assumed")
    if draft.options.density is None and draft.options.mass is None:
        _give_masses_of_like_parts(draft)
    _give_masses(draft)
    _reach_total(draft)


def _drop_dummies(draft: Draft) -> None:
    """Drop inertials of links lighter than air; all of them where the whole robot is absurd."""
    measures = draft.measures
    total, span = measures.total_mass, measures.span
    whole = 0.0 < total < rules.MASS_PER_SPAN[0] * span**3
    for link in measures.file.links:
        if link.mass and (whole or dummy(measures, link)):
            why = f"the robot's {grams(total)} is a dummy" if whole else "it is lighter than air"
            _drop_inertial(draft, link, f"mass {link.mass:g} kg: {why}")


def _drop_inertial(draft: Draft, link: Link, why: str) -> None:
    inertial = link.element.find("inertial")
    if inertial is not None:
        link.element.remove(inertial)
        draft.change(f"link {link.name!r}", f"inertial dropped: {why}")


def _give_masses_of_like_parts(draft: Draft) -> None:
    """Give links without a mass that of the same link of other legs, where most have one."""
    measures = draft.measures
    drawn, bare = _without_mass(measures)
    known = mass_of_like_parts(measures)
    for link, body in drawn:
        if (mass := known.get(link.name)) is not None and body.volume > 0.0:
            before = _written(link)
            inertia = mass / body.volume * body.inertia
            write_inertial(link.element, mass, body.centre, inertia)
            assumed = f"mass {mass:.4g} kg of the same part of other legs, uniform in its shape"
            draft.change(f"link {link.name!r}", f"mass {before} -> {mass:.4g} kg", assumed)
    for link in bare:
        if link.name in known:
            _write_ball(draft, measures, link, known[link.name])


def _give_masses(draft: Draft) -> None:
    """Give masses to the links of bodies that have none."""
    measures = draft.measures
    drawn, bare = _without_mass(measures)
    if not drawn and not bare:
        if draft.options.density is not None:
            draft.note("--density is not used: every moved body has a mass")
        return
    shares = _shares(draft, measures, drawn, bare)
    given = draft.options.density is not None or draft.options.mass is not None
    for link, body in shares.drawn:
        mass, before = shares.density * body.volume, _written(link)
        write_inertial(link.element, mass, body.centre, shares.density * body.inertia)
        assumed = f"mass and inertia of a uniform body of {shares.density:.4g} kg/m^3"
        if measures.solid(link) is None:
            assumed += ", of which nothing is drawn: a rod or plate between its joints"
        elif not given:
            assumed += " in its convex hull (median of public hexapods)"
        draft.change(f"link {link.name!r}", f"mass {before} -> {mass:.4g} kg", assumed)
    for link in shares.bare:
        _write_ball(draft, measures, link, shares.bare_mass)


def _write_ball(draft: Draft, measures: Measures, link: Link, mass: float) -> None:
    if mass <= 0.0:
        return
    radius, before = rules.SMALL_SIZE * (measures.size or 1.0), _written(link)
    write_inertial(link.element, mass, np.zeros(3), 0.4 * mass * radius**2 * np.eye(3))
    assumed = f"mass {mass:.3g} kg of a ball of radius {radius:.2g} m: nothing is drawn of it"
    draft.change(f"link {link.name!r}", f"mass {before} -> {mass:.4g} kg", assumed)


def _written(link: Link) -> str:
    return "none" if link.mass is None else f"{link.mass:g}"


def _without_mass(measures: Measures) -> tuple[list[tuple[Link, Solid]], list[Link]]:
    """Return the links that get the mass of bodies without one.

    Those with a solid, else with a body between joints, else the first link of the body.
    """
    drawn, bare = list[tuple[Link, Solid]](), list[Link]()
    for group in bodies(measures.file):
        links = [measures.file.link_by_name[name] for name in group]
        if math.fsum(link.mass or 0.0 for link in links) > 0.0:
            continue
        found = [(link, body) for link in links if (body := measures.solid(link))]
        found = found or [(link, body) for link in links if (body := measures.body(link))]
        drawn += found
        bare += [] if found else links[:1]
    return drawn, bare


def _shares(
    draft: Draft, measures: Measures, drawn: list[tuple[Link, Solid]], bare: list[Link]
) -> Shares:
    """Return density and small mass; they give the requested total, if any."""
    volume = math.fsum(body.volume for _, body in drawn)
    density, total = draft.options.density or rules.DENSITY, draft.options.mass
    small = rules.SMALL_SHARE * len(bare)
    if total is None:
        total = (measures.total_mass + density * volume) / (1.0 - min(small, 0.5))
        return Shares(tuple(drawn), tuple(bare), density, rules.SMALL_SHARE * total)
    rest = total - measures.total_mass
    if volume > 0.0 and rest > small * total:
        density = (rest - small * total) / volume
        return Shares(tuple(drawn), tuple(bare), density, rules.SMALL_SHARE * total)
    even = max(rest, 0.0) / max(len(bare), 1) if volume <= 0.0 else rules.SMALL_SHARE * total
    return Shares(tuple(drawn), tuple(bare), density, even)


def _reach_total(draft: Draft) -> None:
    """Scale masses and inertias to the total that the user gives."""
    total, given = draft.measures.total_mass, draft.options.mass
    if given is None or total <= 0.0 or math.isclose(total, given, rel_tol=1e-6):
        return
    _scale_to(draft, given)


def _scale_to(draft: Draft, new: float, assumed: str = "") -> None:
    """Scale masses and inertias to a total [kg]."""
    total = draft.measures.total_mass
    for inertial in draft.root.findall("link/inertial"):
        for element in [*inertial.findall("mass"), *inertial.findall("inertia")]:
            _scale(element, new / total)
    text = f"all masses and inertias multiplied by {new / total:.6g}: {total:.6g} -> {new:g} kg"
    draft.change("robot", text, assumed)


def _scale(element: ET.Element, factor: float) -> None:
    for name, text in element.attrib.items():
        try:
            element.set(name, f"{factor * float(text):.12g}")
        except ValueError:
            continue


# What is absurd about a robot as a whole: its mass, its size, the units of its numbers.

SCALE_FIRST = "scale the lengths first: no rule holds for a robot of such a size"
"""Remedy for faults that are repaired only in a robot of a possible size."""


def whole_findings(measures: Measures) -> list[Finding]:
    """Return every trouble of the robot as a whole; nothing of files without moved joints."""
    angles, lengths = angle_slip(measures), joint_length_slip(measures)
    slips = [lengths, angles, mass_slip(measures), inertia_slip(measures)]
    slips += [*length_slips(measures), *mesh_slips(measures).values()]
    sized = measures.plausible_size or slips[0] is not None
    found = [*_whole_frame(measures), *_trunk_off(measures)]
    found += [*_same_mass(measures), *_twice(measures)]
    found += [_slip(slip, sized) for slip in slips if slip is not None]
    kinds = {slip.kind for slip in slips if slip is not None}
    if "joints" not in kinds:
        found += _size(measures)
        if "masses" not in kinds and measures.plausible_size:
            found += _mass(measures)
    return found


def _slip(slip: UnitSlip, sized: bool) -> Finding:
    """Return a finding; masses and inertias are scaled where the size of the robot is possible."""
    repairable = sized or slip.kind not in ("masses", "inertias")
    si = {"masses": "kg", "inertias": "kg m^2", "angles": "rad"}.get(slip.kind, "m")
    cure = f"all multiplied by {slip.factor:g}" if repairable else SCALE_FIRST
    return Finding(
        f"{slip.kind} in {slip.unit}", "robot", slip.value, f"in {si}", cure, "suspicious",
        repairable=repairable,
    )  # fmt: skip


def _size(measures: Measures) -> Iterator[Finding]:
    if not measures.plausible_size:
        yield Finding.of("absurd size", "robot", f"joints span {measures.span:.3g} m")


def _mass(measures: Measures) -> Iterator[Finding]:
    span, total, (low, high) = measures.span, measures.total_mass, rules.MASS_PER_SPAN
    low, high = low * span**3, high * span**3
    too_heavy = heavy(measures)
    if span <= 0.0 or total <= 0.0 or (low <= total <= high and not too_heavy):
        return
    repair = "give --mass, which scales all masses and inertias"
    if total < low:
        repair = "from the links' solids and --density, or --mass"
    elif too_heavy:
        high = min(high, _largest_mass(measures))
        repair = f"all masses and inertias scaled to {grams(usual_mass(measures))}, or --mass"
    yield Finding(
        "absurd mass",
        "robot",
        f"{grams(total)} on a span of {span:.3g} m",
        f"{grams(low)} to {grams(high)} is plausible",
        repair,
        "suspicious",
        repairable=total < low or too_heavy,
    )


def _same_mass(measures: Measures) -> Iterator[Finding]:
    """Yield that all links have one mass, and the robot more than one of its size."""
    each = uniform_mass(measures)
    if each is not None and measures.span > 0.0 and measures.total_mass > _largest_mass(measures):
        count = sum(bool(link.mass) for link in measures.file.links)
        yield Finding(
            SAME_MASS, "robot", f"{grams(each)} in each of {count} links", "each link has its own",
            "give --mass, which scales all masses and inertias", "suspicious", repairable=False,
        )  # fmt: skip


SAME, COUNTS = (1e-6, 1e-9), 0.05
"""Relative and absolute difference up to which numbers of two bodies are one, and mass over the
robot's from which a body that counts twice is said (*assumed*)."""


def _twice(measures: Measures) -> Iterator[Finding]:
    """Yield that a link has the mass, inertia and centre of mass of one that it is fixed to."""
    places, least = measures.places, COUNTS * measures.total_mass
    numbers = {
        x.name: (x.mass, *x.moments, *(places[x.name][1] + places[x.name][0] @ x.com))
        for x in measures.file.links
        if x.name in places and (x.mass or 0.0) > least
    }
    for first, own in numbers.items():
        for again in measures.file.rigid_group(first)[1:]:
            if again in numbers and np.allclose(own, numbers[again], *SAME):
                value = f"has mass and inertia of {first}, to which it is fixed"
                yield Finding(
                    TWICE, f"link {again!r}", value, "a body counts once",
                    "take one <inertial> out by hand", "suspicious", repairable=False,
                )  # fmt: skip


def heavy(measures: Measures) -> bool:
    """Return whether a robot is heavier than its legs could ever be, without its heaviest link.

    Only where its meshes were looked for: without those of the feet legs look too short.
    """
    known = measures.solids.finder is not None and measures.span > 0.0 and measures.chains
    most = rules.HEAVY * _largest_mass(measures) if known else math.inf
    heaviest = max((link.mass or 0.0 for link in measures.file.links), default=0.0)
    return 0.0 < most < measures.total_mass - heaviest and measures.plausible_size


def _largest_mass(measures: Measures) -> float:
    """Return the largest plausible mass of the robot [kg]."""
    return plausible_mass(measures.leg_length, _motors(measures))[1]


def usual_mass(measures: Measures) -> float:
    """Return what a robot with such legs usually weighs, to two digits [kg]."""
    own = rules.MOTOR_MASS[1] * _motors(measures)
    return two_digits(max(rules.USUAL_MASS_PER_LEG * measures.leg_length**3, own))


def _motors(measures: Measures) -> int:
    return sum(len(chain) for chain in measures.chains)


# Centres of mass in the frame of the whole robot.


def in_robot_frame(measures: Measures) -> bool:
    """Return whether centres of mass have the places that they have in the whole robot's frame.

    Of most links they then are nearer to the link's place in the robot than to its own origin.
    """
    ratios = []
    for link in measures.file.links:
        place = measures.places.get(link.name)
        own = math.hypot(*finite(link.com))
        if link.mass and place is not None and own > 0.0 and np.any(place[1]):
            ratios.append(math.dist(place[1], finite(link.com)) / own)
    return len(ratios) >= FEWEST_PLACED and median(ratios) < NEARER


FEWEST_PLACED = 4
"""Links of which the frame of centres of mass is judged."""

NEARER = 0.5
"""Distance from the link's place over that from the link's origin (18 robots have 3 to 13)."""


def _whole_frame(measures: Measures) -> Iterator[Finding]:
    """Yield that centres of mass are in the frame of the whole robot."""
    if in_robot_frame(measures):
        yield Finding(
            IN_ROBOT_FRAME, "robot", "each lies near the place of its link in the robot",
            "in the frame of the link: an exporter wrote them in that of the assembly",
            "turned and moved into the frames of the links", "suspicious",
        )  # fmt: skip


def _repair_frame(draft: Draft) -> None:
    """Bring centres of mass, and the axes of inertias, from the robot's frame to the links'."""
    measures = draft.measures
    if not in_robot_frame(measures):
        return
    for link in measures.file.links:
        found = link.element.find("inertial/origin")
        if found is None or link.name not in measures.places or not readable(link):
            continue
        turn, place = measures.places[link.name]
        axes = turn.T @ rotation(link.inertia_rpy)
        for name, values in (
            ("xyz", turn.T @ (np.array(link.com) - place)),
            ("rpy", roll_pitch_yaw(axes)),
        ):
            found.set(name, " ".join(number(float(value)) for value in values))
    text = "centres of mass moved from the robot's frame into those of the links"
    draft.change("robot", text, "inertials were in the frame of the whole robot")


TRUNK_OFF = 0.4
"""Distance of the trunk's centre of mass from the middle of the hips, in their plane, over that of
the farthest hip, from which it is doubted (*assumed*): 16 robots have 0 to 0.15."""

FEWEST_HIPS = 4
"""Hips around a trunk whose middle is known."""


def _trunk_off(measures: Measures) -> Iterator[Finding]:
    """Yield that the trunk's centre of mass lies far from the middle of the hips."""
    file, places = measures.file, measures.places
    root = trunk_root(file)
    heads = [chain[0].child for chain in measures.chains if len(chain) > 1]
    hips = np.array([places[name][1] for name in heads if name in places]).reshape(-1, 3)
    if root is None or len(hips) < FEWEST_HIPS or in_robot_frame(measures):
        return
    links = [file.link_by_name[x] for x in trunk_links(file, root) if x in file.link_by_name]
    known = [(x.mass or 0.0, places[x.name]) for x in links if readable(x) and x.name in places]
    total = math.fsum(mass for mass, _ in known)
    if total <= 0.0:
        return
    heavy = [link for link in links if readable(link) and link.name in places]
    centre = sum(
        (mass / total * (place + turn @ np.array(link.com))
         for link, (mass, (turn, place)) in zip(heavy, known, strict=True)),
        np.zeros(3),
    )  # fmt: skip
    middle = hips.mean(axis=0)
    plane = np.linalg.svd(hips - middle)[2][:2]
    off = float(np.linalg.norm(plane @ (centre - middle)))
    far = float(np.linalg.norm((hips - middle) @ plane.T, axis=1).max())
    if off > TRUNK_OFF * far > 0.0:
        value = f"{off:.3g} m off the middle of the hips, which are {far:.3g} m from it"
        yield Finding(
            OFF_HIPS, "robot", value, "between the hips", "correct it by hand", "suspicious",
            repairable=False,
        )  # fmt: skip


# Masses of parts that are alike, from the same link of other legs.

FEWEST_ALIKE = 2
"""Parts with a mass from which that of another is taken; and they are at least half of all."""


def mass_of_like_parts(measures: Measures) -> dict[str, float]:
    """Return the mass of links without one that others in the same place of their legs have [kg].

    Alike are the links that the k-th joints of chains of equally many joints move.
    """
    places: dict[tuple[int, int], list[str]] = {}
    for chain in measures.chains:
        for k, joint in enumerate(chain):
            places.setdefault((len(chain), k), []).append(joint.child)
    found: dict[str, float] = {}
    for links in places.values():
        masses = {name: measures.file.link_by_name[name].mass or 0.0 for name in links}
        known = [mass for mass in masses.values() if mass > 0.0]
        if len(known) >= FEWEST_ALIKE and 2 * len(known) >= len(links):
            found |= {name: median(known) for name, mass in masses.items() if not mass > 0.0}
    return found

"""Masses of parts that are alike: the same link of the other legs tells what one weighs."""

from __future__ import annotations

from statistics import median

from hexapod_pin.robot.mending.measures import Measures

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

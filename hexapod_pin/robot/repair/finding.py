"""A finding is one fault of a URDF with its place, value, rule and repair.

A draft is a URDF under repair, with the options of the user and a list of all changes.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Annotated

from pydantic import Field

from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_tree
from hexapod_pin.robot.repair.measures import LinkSolids, Measures, MeshFinder
from hexapod_pin.robot.repair.rules import RULES, Severity
from hexapod_pin.spec import Kilograms, Spec


@dataclass(frozen=True)
class Finding:
    """One fault at one place.

    Attributes:
        what: short kind, such as "zero inertia".
        where: such as "link 'tibia_1'".
        value: as found, with its unit.
        rule: what is allowed.
        repair: what the repair does, with the option that changes it; without a repair, what the
            user must do.
        severity: "refused" (the file cannot be used) or "suspicious" (it is used, but this is
            reported).
        repairable: whether `repair_urdf` removes it.
    """

    what: str
    where: str
    value: str
    rule: str
    repair: str
    severity: Severity = "refused"
    repairable: bool = True

    @staticmethod
    def of(what: str, where: str, value: str) -> Finding:
        """Return a finding of a kind that `RULES` has."""
        return Finding(what, where, value, *RULES[what])

    def __str__(self) -> str:
        """Return the finding as a sentence."""
        return f"{self.where}: {self.what}: {self.value}; {self.rule}"


@dataclass(frozen=True)
class FoldedFinding:
    """The same finding at several places.

    Attributes:
        finding: the first of them.
        places: where; at least one.
        values: the different values, in order of appearance.
    """

    finding: Finding
    places: tuple[str, ...]
    values: tuple[str, ...]


def folded(findings: Iterable[Finding]) -> list[FoldedFinding]:
    """Fold findings of one kind, rule and repair; those that refuse come first."""
    groups: dict[tuple[object, ...], list[Finding]] = {}
    for found in findings:
        key = (found.severity, found.what, found.rule, found.repair, found.repairable)
        groups.setdefault(key, []).append(found)
    ordered = sorted(groups.values(), key=lambda group: group[0].severity == "suspicious")
    return [
        FoldedFinding(
            group[0],
            tuple(dict.fromkeys(found.where for found in group)),
            tuple(dict.fromkeys(found.value for found in group)),
        )
        for group in ordered
    ]


# Findings as blocks of text: what, where, value, rule, and what the repair does.

MOST_VALUES = 3
"""Different values that a block shows; more are counted."""

TITLES = {"refused": "REFUSED", "suspicious": "suspicious"}


def finding_lines(findings: Iterable[Finding]) -> list[str]:
    """Return the lines of all findings; those of one kind on many parts are one block."""
    return [line for block in folded(findings) for line in _block(block)]


def places_text(places: Sequence[str], most: int | None = None) -> str:
    """Return places of one kind as a count and their names; others one after another.

    Args:
        places: such as "link 'tibia_1'".
        most: names that are written; None: all.
    """
    kinds = {place.partition(" ")[0] for place in places}
    if len(places) == 1 or len(kinds) > 1:
        return ", ".join(places)
    names = [place.partition(" ")[2] for place in places]
    left = [] if most is None or len(names) <= most else ["..."]
    return f"{len(places)} {kinds.pop()}s: {', '.join([*names[:most], *left])}"


def _block(block: FoldedFinding) -> list[str]:
    found, values = block.finding, block.values[:MOST_VALUES]
    more = len(block.values) - len(values)
    text = "; ".join(values) + (f"; and {more} other values" if more else "")
    return [
        f"{TITLES[found.severity]}: {found.what}",
        f"  where  {places_text(block.places)}",
        f"  value  {text}",
        f"  rule   {found.rule}",
        f"  repair   {'' if found.repairable else 'none: '}{found.repair}",
    ]


# A URDF under repair: its tree, and a sentence on every change.

MOST_NAMED = 6
"""Places that a sentence names; more are counted."""


class Draft:
    """The tree of a file; repairs change it and record every change."""

    def __init__(self, file: UrdfFile, finder: MeshFinder | None, options: RepairOptions) -> None:
        """Copy the tree of the file, comments included."""
        self.source, self.options, self.repairs = file.source, options, file.repairs
        self.root = parse_tree(file.text, file.source, comments=True)
        self.solids = LinkSolids(finder)
        self._changes: dict[str, list[str]] = {}
        self._assumed: dict[str, list[str]] = {}
        self.notes: list[str] = []

    @property
    def file(self) -> UrdfFile:
        """The tree as it is now, as links and joints."""
        return UrdfFile(self.source, "", self.root)

    @property
    def measures(self) -> Measures:
        """Sizes of the robot as it is now."""
        return Measures(self.file, self.solids)

    def change(self, where: str, text: str, assumed: str = "") -> None:
        """Record a change, with before and after, and an assumption, to be written in the file."""
        self._changes.setdefault(text, []).append(where)
        if assumed:
            self._assumed.setdefault(assumed, []).append(where)

    def note(self, text: str) -> None:
        """Keep a sentence, once however often it is said."""
        if text not in self.notes:
            self.notes.append(text)

    def drop(self, elements: Iterable[ET.Element]) -> None:
        """Remove links, joints or materials of the robot."""
        for element in elements:
            self.root.remove(element)

    @property
    def changes(self) -> tuple[str, ...]:
        """All changes; equal ones in one sentence."""
        return tuple(_folded(places, text) for text, places in self._changes.items())

    @property
    def assumed(self) -> tuple[str, ...]:
        """All assumptions; equal ones in one sentence."""
        return tuple(_folded(places, text) for text, places in self._assumed.items())


def scaled(text: str, power: int) -> str:
    """Return the numbers of a text times a power of ten, exactly; other parts as they are."""
    return _multiplied(text, lambda number: number.scaleb(power))


def multiplied(text: str, factor: float) -> str:
    """Return the numbers of a text times a short decimal, exactly; other parts as they are."""
    by = Decimal(repr(factor))
    return _multiplied(text, lambda number: number * by)


def _multiplied(text: str, change: Callable[[Decimal], Decimal]) -> str:
    parts = []
    for part in text.split():
        try:
            parts.append(str(change(Decimal(part))))
        except InvalidOperation:
            parts.append(part)
    return " ".join(parts)


def number(value: float) -> str:
    """Return a number as it is written into a file, to nine digits."""
    return f"{value:.9g}"


def _folded(places: list[str], text: str) -> str:
    places = list(dict.fromkeys(places))
    kinds = {place.partition(" ")[0] for place in places}
    if len(places) == 1 or len(kinds) > 1:
        return f"{', '.join(places)}: {text}"
    names = [place.partition(" ")[2] for place in places]
    shown = ", ".join(names[:MOST_NAMED]) + (", ..." if len(names) > MOST_NAMED else "")
    return f"{len(names)} {kinds.pop()}s ({shown}): {text}"


# Numbers that a user gives where the file has none.


class RepairOptions(Spec):
    """Numbers that go before assumed ones; None leaves them to be assumed.

    Attributes:
        mass: total mass [kg], 1e-6 to 2000. Links without a mass share what the others leave; where
            all have one, masses and inertias are scaled.
        density: mass over volume of the convex hull of links without a mass [kg/m^3], 1e-3 to 1e5.
        effort: torque limit of every revolute joint [N m], 1e-9 to 1e6.
        velocity: speed limit of every revolute joint [rad/s], 1e-9 to 1e4.
    """

    mass: Annotated[Kilograms, Field(ge=1e-6)] | None = None
    density: Annotated[float, Field(ge=1e-3, le=1e5)] | None = None
    effort: Annotated[float, Field(ge=1e-9, le=1e6)] | None = None
    velocity: Annotated[float, Field(ge=1e-9, le=1e4)] | None = None

"""A URDF while it is mended: its tree, and what is said of every change."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from decimal import Decimal, InvalidOperation

from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_tree
from hexapod_pin.robot.mending.link_solids import LinkSolids, MeshFinder
from hexapod_pin.robot.mending.measures import Measures
from hexapod_pin.robot.mending.options import MendOptions

MOST_NAMED = 6
"""Places that a sentence names; more are counted."""


class Draft:
    """The tree of a file; mends change it and say so."""

    def __init__(self, file: UrdfFile, finder: MeshFinder | None, options: MendOptions) -> None:
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
        """Say a change, with before and after, and what it assumes, to be written in the file."""
        self._changes.setdefault(text, []).append(where)
        if assumed:
            self._assumed.setdefault(assumed, []).append(where)

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
    """Return the numbers of a text times a power of ten, exactly; other words as they are."""
    words = []
    for word in text.split():
        try:
            words.append(str(Decimal(word).scaleb(power)))
        except InvalidOperation:
            words.append(word)
    return " ".join(words)


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

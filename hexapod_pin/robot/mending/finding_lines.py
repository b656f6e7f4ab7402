"""Findings as blocks of text: what, where, value, rule, and what the repair does."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hexapod_pin.robot.mending.finding import Finding, FoldedFinding, folded

MOST_VALUES = 3
"""Different values that a block shows; more are counted."""

TITLES = {"refused": "REFUSED", "suspicious": "suspicious"}


def finding_lines(findings: Iterable[Finding]) -> list[str]:
    """Return the lines of all findings; those of one kind on many parts are one block."""
    return [line for block in folded(findings) for line in _block(block)]


def places_text(places: Sequence[str]) -> str:
    """Return places of one kind as a count and their names; others one after another."""
    kinds = {place.partition(" ")[0] for place in places}
    if len(places) == 1 or len(kinds) > 1:
        return ", ".join(places)
    names = ", ".join(place.partition(" ")[2] for place in places)
    return f"{len(places)} {kinds.pop()}s: {names}"


def _block(block: FoldedFinding) -> list[str]:
    found, values = block.finding, block.values[:MOST_VALUES]
    more = len(block.values) - len(values)
    text = "; ".join(values) + (f"; and {more} other values" if more else "")
    return [
        f"{TITLES[found.severity]}: {found.what}",
        f"  where  {places_text(block.places)}",
        f"  value  {text}",
        f"  rule   {found.rule}",
        f"  mend   {'' if found.repairable else 'none: '}{found.mend}",
    ]

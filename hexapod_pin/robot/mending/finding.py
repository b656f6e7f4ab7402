"""One fault of a URDF: what, where, with which value, by which rule, and what repairs it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Severity = Literal["refused", "suspicious"]


@dataclass(frozen=True)
class Finding:
    """One fault at one place.

    Attributes:
        what: short kind, such as "zero inertia".
        where: such as "link 'tibia_1'".
        value: as found, with its unit.
        rule: what is allowed.
        mend: what the repair does, with the option that changes it; without a repair, what the
            user must do.
        severity: "refused" (the file cannot be used) or "suspicious" (it is used, but this is
            reported).
        repairable: whether `mend_urdf` removes it.
    """

    what: str
    where: str
    value: str
    rule: str
    mend: str
    severity: Severity = "refused"
    repairable: bool = True

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
        key = (found.severity, found.what, found.rule, found.mend, found.repairable)
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

"""What happened in a run at one time and place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Event:
    """Something that happened.

    Attributes:
        time: [s].
        kind: "trunk-contact": a point of the trunk came to touch the ground.
        what: name of the part.
        place: where, world axes [m].
    """

    time: float
    kind: str
    what: str
    place: tuple[float, float, float]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**asdict(self), "place": list(self.place)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Event:
        """Return what `to_dict` was of."""
        x, y, z = data["place"]
        return cls(float(data["time"]), str(data["kind"]), str(data["what"]), (x, y, z))

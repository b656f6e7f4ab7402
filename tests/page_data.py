"""What a playback page holds, read back as its own script reads it."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np

from hexapod_pin.view.sample_block import inflated, unpacked


class PageData:
    """The data of a page: `runs` as plain data, `arrays` (N, columns) of its block."""

    def __init__(self, page: str) -> None:
        """Read a page's text."""
        self.plain: dict[str, Any] = json.loads(inflated(_script(page, "data")))
        self.runs: list[dict[str, Any]] = self.plain["runs"]
        self.arrays = unpacked(inflated(_script(page, "block")), self.plain["table"])

    def channel(self, name: str, run: int = 0) -> np.ndarray:
        """Return the samples of a channel of a run, (N, columns)."""
        return np.asarray(self.arrays[self.runs[run]["channels"][name]])

    def resolution(self, name: str, run: int = 0) -> float:
        """Return what a channel's numbers are rounded to."""
        return float(self.plain["table"][self.runs[run]["channels"][name]]["resolution"])

    def shapes(self, body: str, run: int = 0) -> list[dict[str, Any]]:
        """Return the shapes of a body."""
        [found] = [b for b in self.runs[run]["tree"] if b["name"] == body]
        return list(found["shapes"])

    def ground(self, run: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Return corners (V, 3) [m] and triangles (F, 3) of a ground, as the page makes them."""
        data = self.runs[run]["ground"]
        if "mesh" in data:
            corners, index = (self.arrays[k] for k in data["mesh"])
            return corners, index.astype(int).reshape(-1, 3)
        n, heights = data["rows"], self.arrays[data["heights"]]
        x, y = (np.linspace(data["low"][k], data["high"][k], n) for k in range(2))
        corners = np.stack([*np.meshgrid(x, y), heights], axis=-1).reshape(-1, 3)
        k = np.arange(n * n).reshape(n, n)
        a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
        return corners, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _script(page: str, name: str) -> str:
    found = re.search(rf'<script id="{name}" type="text/plain">(.*?)</script>', page, re.DOTALL)
    assert found
    return found[1]


class Loads(HTMLParser):
    """Collects every address that a page would load, and its policy."""

    def __init__(self, page: str) -> None:
        """Parse the page."""
        super().__init__()
        self.addresses: list[str] = []
        self.policy = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note src, href and the like."""
        values = dict(attrs)
        self.addresses += [f"{tag} {values[key]}" for key in ("src", "href") if key in values]
        if values.get("http-equiv") == "Content-Security-Policy":
            self.policy = values["content"] or ""

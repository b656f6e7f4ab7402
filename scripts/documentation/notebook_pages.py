"""Pages of executed notebooks and examples; pages in frames and pictures become files."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nbformat

FRAME = re.compile(r'srcdoc="([^"]*)"|srcdoc=\'([^\']*)\'')
PICTURES = (".png", ".svg")
"""Endings of what an example draws."""
FIRST_EXAMPLE = "walk"
"""The example whose playback is on the gallery's first page."""


@dataclass
class Page:
    """The text of a page, HTML that stands in for comments in it, and files beside it.

    Attributes:
        text: Markdown.
        inserts: HTML by the name in `<div data-insert="name"></div>`.
        files: contents by name, in the folder of the page.
    """

    text: str
    inserts: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    def insert(self, name: str, text: str) -> str:
        """Keep HTML aside, which Markdown would parse for long; return the line for it."""
        self.inserts[name] = text
        return f'<div data-insert="{name}"></div>\n'

    def filled(self, text: str) -> str:
        """Return the HTML of the page with what was kept aside."""
        for name, inner in self.inserts.items():
            text = text.replace(f'<div data-insert="{name}"></div>', inner)
        return text


def notebook_page(executed: Path) -> Page:
    """Return the page of an executed notebook: its text, its code, and what each cell showed."""
    page, parts = Page(""), []
    for k, cell in enumerate(nbformat.read(executed, as_version=4).cells):
        if cell.cell_type == "markdown":
            parts.append(f"{cell.source}\n")
            continue
        parts.append(f"```python\n{cell.source}\n```\n")
        for n, output in enumerate(cell.get("outputs", ())):
            parts.append(_shown(page, f"{executed.stem}_{k}_{n}", output))
    name = executed.name
    page.files[name] = executed.read_bytes()
    parts.append(f"[The executed notebook]({name}){{ download }}\n")
    page.text = "\n".join(parts)
    return page


def _shown(page: Page, name: str, output: Mapping[str, Any]) -> str:
    """Return the Markdown of an output, the richest of its formats."""
    data: Mapping[str, Any] = output.get("data", {})
    if "text/html" in data:
        return page.insert(name, _with_framed_files(page, name, data["text/html"]))
    if "image/svg+xml" in data:
        page.files[f"{name}.svg"] = data["image/svg+xml"].encode()
        return f"![figure]({name}.svg)\n"
    if "image/png" in data:
        page.files[f"{name}.png"] = base64.b64decode(data["image/png"])
        return f"![figure]({name}.png)\n"
    text = output.get("text") or data.get("text/plain", "")
    return f"```text\n{text.rstrip()}\n```\n" if text.strip() else ""


def _with_framed_files(page: Page, name: str, text: str) -> str:
    """Return HTML whose frames load their pages from files, when they come into view."""

    def change(match: re.Match[str]) -> str:
        file = f"{name}_{len(page.files)}.html"
        page.files[file] = html.unescape(match[1] or match[2] or "").encode()
        return f'loading="lazy" src="{file}"'

    return FRAME.sub(change, text)


def example_page(script: Path, executed: Path) -> Page:
    """Return the page of an example: what it shows, left behind and printed, and its text."""
    source = script.read_text(encoding="utf-8")
    title, _, rest = (ast_docstring(source)).partition("\n")
    page, parts = Page(""), [f"# {title}\n", f"{rest.strip()}\n"]
    left = sorted(path for path in executed.iterdir() if path.name != "printed.txt")
    for path in left:
        if path.suffix in PICTURES:
            page.files[f"files/{path.name}"] = path.read_bytes()
            parts.append(f"![{path.stem}](files/{path.name})\n")
        elif path.suffix == ".html":
            page.files[f"files/{path.name}"] = path.read_bytes()
            parts.append(page.insert(path.stem, frame(f"files/{path.name}")))
            parts.append(f"[Open the page alone](files/{path.name})\n")
    parts.append("It prints:\n")
    printed = (executed / "printed.txt").read_text(encoding="utf-8").rstrip()
    parts.append(f"```text\n{printed}\n```\n")
    parts.append(f"`examples/{script.name}`:\n\n```python\n{source.rstrip()}\n```\n")
    page.text = "\n".join(parts)
    return page


def frame(source: str) -> str:
    """Return a frame for a page of this package, as high as it needs."""
    return f'<iframe class="playback" loading="lazy" src="{source}" title="{source}"></iframe>'


def ast_docstring(source: str) -> str:
    """Return the docstring of a module's text."""
    import ast

    return ast.get_docstring(ast.parse(source)) or ""


def gallery_page(listing: str, executed: Path) -> Page:
    """Return the gallery: the walk, a picture of each example, and the table of all.

    Args:
        listing: `examples/README.md`.
        executed: the folder of the executed examples.
    """
    head, _, table = listing.partition("\n\n")
    page = Page("")
    walk = executed / FIRST_EXAMPLE / f"{FIRST_EXAMPLE}.html"
    page.files[f"files/{walk.name}"] = walk.read_bytes()
    tiles = []
    for folder in sorted(path for path in executed.iterdir() if path.is_dir()):
        for picture in sorted(folder.glob("*.png")):
            place = f"files/{picture.name}"
            page.files[place] = picture.read_bytes()
            tiles.append(
                f'<a href="{folder.name}.html"><img loading="lazy" src="{place}" alt="">'
                f"<span>{folder.name}</span></a>"
            )
    page.text = "\n".join([
        head.replace("# Examples", "# Gallery") + "\n",
        page.insert("walk", frame(f"files/{walk.name}")),
        page.insert("tiles", f'<div class="tiles">{"".join(tiles)}</div>'),
        table,
    ])  # fmt: skip
    return page

"""Pages of the site that stand outside of `docs/`, and links between places in the repository."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

OUTSIDE = {
    "README.md": "index.md",
    "docs/README.md": "pages.md",
    "urdf/README.md": "robot_descriptions.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "examples/README.md": "gallery/index.md",
}
"""Place on the site by place in the repository; all else in `docs/` keeps its path."""

LINK = re.compile(r"(\]\()([^)\s#]+)(#[^)\s]*)?(\))")
CODE = re.compile(r"(```.*?```|`[^`\n]+`)", re.DOTALL)


def site_path(path: str) -> str:
    """Return where a file of the repository is on the site."""
    if path in OUTSIDE:
        return OUTSIDE[path]
    folder, _, name = path.partition("/")
    if folder == "docs":
        return name
    if folder == "examples" and name.endswith(".py"):
        return f"gallery/{Path(name).stem}.md"
    if folder == "notebooks" and name.endswith(".ipynb"):
        return f"notebooks/{Path(name).stem}.md"
    return f"repository/{path}"


def repository_path(page: str) -> str:
    """Return which file of the repository a page of the site shows."""
    back = {there: here for here, there in OUTSIDE.items()}
    return back.get(page, f"docs/{page}")


def linked_files(path: str, text: str) -> set[str]:
    """Return the files of the repository that a page links to; folders and addresses are none."""
    targets = {match[2] for match in LINK.finditer(CODE.sub("", text))}
    found = {
        posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        for target in targets
        if "://" not in target
    }
    return {one for one in found if (ROOT / one).is_file()}


def with_links_of_the_site(path: str, page: str, text: str) -> str:
    """Return the text of a page, its links changed from places in the repository to the site's."""

    def change(match: re.Match[str]) -> str:
        target = match[2]
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        there = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        there = posixpath.relpath(site_path(there), posixpath.dirname(page) or ".")
        return f"{match[1]}{there}{match[3] or ''}{match[4]}"

    parts = CODE.split(text)  # every second part is code
    parts[::2] = [LINK.sub(change, part) for part in parts[::2]]
    return "".join(parts)

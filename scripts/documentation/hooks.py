"""What MkDocs calls when it builds the site: pages that are generated, links, equations.

Examples and notebooks must have been executed before; `make docs` does both.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from documentation.api_pages import api_pages, commands_page  # noqa: E402
from documentation.equations import math_fence  # noqa: E402
from documentation.execute import examples, notebooks  # noqa: E402
from documentation.notebook_pages import (  # noqa: E402
    Page,
    example_page,
    gallery_page,
    notebook_page,
)
from documentation.repository import (  # noqa: E402
    OUTSIDE,
    ROOT,
    linked_files,
    repository_path,
    with_links_of_the_site,
)

EXECUTED = ROOT / "build" / "executed"

EVIDENCE = ("results/", "gallery/", "changelog")
"""Where pages begin that the search lists behind those that explain."""

BEHIND = 0.3
"""Weight of such a page in the search, over that of others."""

_pages: dict[str, Page] = {}


def generated_pages() -> set[str]:
    """Return the places of the pages on the site that have no file below `docs/`."""
    found = {*OUTSIDE.values(), "commands.md", *api_pages()}
    found |= {f"gallery/{path.stem}.md" for path in examples()}
    return found | {f"notebooks/{path.stem}.md" for path in notebooks()}


def on_config(config: Any) -> Any:
    """Give the extension for fenced blocks the one for equations."""
    fences = config.mdx_configs.setdefault("pymdownx.superfences", {})
    fences["custom_fences"] = [{"name": "math", "class": "equations", "format": math_fence}]
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages, and every file of the repository that a page links to."""
    if not EXECUTED.is_dir():
        raise PluginError("examples and notebooks are not executed yet: run `make docs`")
    _pages.clear()
    for path in examples():
        _pages[f"gallery/{path.stem}.md"] = example_page(path, EXECUTED / path.stem)
    for path in notebooks():
        executed = EXECUTED / f"notebook_{path.stem}" / path.name
        _pages[f"notebooks/{path.stem}.md"] = notebook_page(executed)
    for here, there in OUTSIDE.items():
        _pages[there] = Page((ROOT / here).read_text(encoding="utf-8"))
    _pages["gallery/index.md"] = gallery_page(_pages["gallery/index.md"].text, EXECUTED)
    _pages["commands.md"] = Page(commands_page())
    _pages.update((name, Page(text)) for name, text in api_pages().items())

    files.remove(files.get_file_from_path("README.md"))
    linked = set()
    for file in files.documentation_pages():
        linked |= linked_files(f"docs/{file.src_uri}", file.content_string)
    for place, page in _pages.items():
        files.append(File.generated(config, place, content=page.text))
        linked |= linked_files(repository_path(place), page.text)
        for name, content in page.files.items():
            beside = f"{place.rpartition('/')[0]}/{name}".lstrip("/")
            if files.get_file_from_path(beside) is None:
                files.append(File.generated(config, beside, content=content))
    for path in sorted(linked):
        place = with_links_of_the_site("x.md", "x.md", f"[a]({path})")[4:-1]
        if files.get_file_from_path(place) is None:
            files.append(File.generated(config, place, content=(ROOT / path).read_bytes()))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Change the links of a page that also stands in the repository; rank it in the search."""
    place = page.file.src_uri
    if place.startswith(EVIDENCE):
        page.meta.setdefault("search", {"boost": BEHIND})
    if place in _pages and place not in OUTSIDE.values():
        return markdown
    return with_links_of_the_site(repository_path(place), place, markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Put in the HTML that was kept aside."""
    found = _pages.get(page.file.src_uri)
    return found.filled(html) if found else html

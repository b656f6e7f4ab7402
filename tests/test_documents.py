"""The documents: links, paths, names and commands in them exist, and their examples run."""

from __future__ import annotations

import importlib
import re
from functools import cache
from pathlib import Path

import pytest
import typer.main
from public_surface import MODULES

import hexapod_pin as hp
from hexapod_pin.commands.app import app

ROOT = Path(__file__).parents[1]
FOLDERS = "hexapod_pin|tests|docs|scripts|examples|notebooks|urdf"
PATTERNS = ("*.md", "docs/**/*.md", "examples/*.md", "urdf/*.md")
PAGES = sorted(page for pattern in PATTERNS for page in ROOT.glob(pattern))
COMMANDS = frozenset(typer.main.get_group(app).commands)


@cache
def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@cache
def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_paths_names_and_commands_exist(page: Path) -> None:
    """Paths from the top of the checkout, in back quotes; `<name>` stands for any name."""
    text = text_of(page)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" not in target:
            path, _, anchor = target.partition("#")
            there = page.parent / path if path else page
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target
    for path in re.findall(rf"`((?:{FOLDERS})/[^`\s]*)`", text):
        if page.stem in ("hard_cases", "speed_against_error") or Path(path).stem == "heun":
            continue  # pages that a command wrote; the method that a page adds
        for one in re.sub(r"<\w+>", "*", path).split(","):
            assert next(ROOT.glob(one.rstrip("/")), None) or one.endswith("_core.pyi"), path
    for name in re.findall(r"\bhp\.([A-Za-z_]\w*)", text):
        assert hasattr(hp, name), f"hp.{name}"
    for path in re.findall(r"`(hexapod_pin(?:\.\w+)+)", text):
        module, _, name = path.rpartition(".")
        try:
            importlib.import_module(path)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(module), name), path
    assert set(re.findall(r"`hexapod-pin ([a-z]+)", text)) <= COMMANDS


def blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text_of(page), re.DOTALL)


IN_DOCS = [page for page in PAGES if page.parent.name == "docs"]
WITH_CODE = [page for page in IN_DOCS if not page.stem.startswith("extending") and blocks(page)]


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    """`test_extending.py` runs those of the pages on extending."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    if page.stem == "playback":  # of any run
        scene = hp.Scene(hp.load_robot("kharagpur"))
        names = {"hp": hp, "trace": hp.simulate(scene, hp.HoldPosture(), duration=0.01)}
    for block in blocks(page):
        exec(compile(block, page.name, "exec"), names)


def test_the_pages_are_short() -> None:
    words = 0
    for page in (ROOT / "docs").glob("*.md"):
        text = re.sub(r"^\s*```.*?^\s*```$", "", text_of(page), flags=re.DOTALL | re.MULTILINE)
        words += len(re.sub(r"^\|.*$", "", text, flags=re.MULTILINE).split())
    assert words <= 40_000
    lines = text_of(ROOT / "README.md").splitlines()
    assert len(lines) <= 120 and max(map(len, lines)) <= 80
    assert (ROOT / "docs" / "walk.gif").stat().st_size < 2_000_000


def test_the_navigation_of_the_site_names_every_page_once() -> None:
    text = text_of(ROOT / "mkdocs.yml").partition("\nnav:\n")[2]
    named = re.findall(r"([\w/]+\.md)$", text, re.MULTILINE)
    docs = ROOT / "docs"
    pages = {page.relative_to(docs).as_posix() for page in docs.rglob("*.md")} - {"README.md"}
    pages |= {f"notebooks/{path.stem}.md" for path in (ROOT / "notebooks").glob("*.ipynb")}
    pages |= {f"api/{room}.md" for room in ("hp", *MODULES)}
    pages |= {"index.md", "pages.md", "robot_descriptions.md", "contributing.md", "changelog.md"}
    pages |= {"commands.md", "gallery/index.md"}
    assert sorted(named) == sorted(pages)
    index = text_of(docs / "README.md")
    for page in docs.glob("*.md"):
        assert page.stem == "README" or f"({page.name})" in index, page.name


@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").glob("*.ipynb")), ids=lambda p: p.stem)
def test_a_notebook_runs_and_is_stored_without_outputs(path: Path, tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    execute = pytest.importorskip("documentation.execute")
    stored = nbformat.read(path, as_version=4)
    nbformat.validate(stored)
    code = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
    done = nbformat.read(execute.run_notebook(path, tmp_path), as_version=4)
    shown = [output for cell in done.cells for output in cell.get("outputs", ())]
    assert all(output.get("name") != "stderr" for output in shown)
    players = [o for o in shown if "srcdoc" in o.get("data", {}).get("text/html", "")]
    assert players or path.stem == "motor_selection"

"""The documents: links, paths, names and commands in them exist, and their examples run."""

from __future__ import annotations

import importlib
import re
from functools import cache
from pathlib import Path

import pytest
import typer.main

import hexapod_pin as hp
from hexapod_pin.commands.app import app

ROOT = Path(__file__).parents[1]
FOLDERS = "hexapod_pin|tests|docs|scripts|examples|urdf"
PAGES = sorted(
    page
    for pattern in ("*.md", "docs/**/*.md", "examples/*.md", "urdf/*.md")
    for page in ROOT.glob(pattern)
)
HAND_WRITTEN = [page for page in PAGES if page.stem not in ("hard_cases", "speed_against_error")]
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)


@cache
def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@every_page
def test_links_lead_somewhere(page: Path) -> None:
    """Files and, behind a #, headings in them."""
    for target in re.findall(r"\]\(([^)\s]+)\)", text_of(page)):
        if "://" not in target:
            path, _, anchor = target.partition("#")
            there = page.parent / path if path else page
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


@cache
def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_index_names_every_page() -> None:
    index = text_of(ROOT / "docs" / "README.md")
    for page in (ROOT / "docs").glob("*.md"):
        assert page.stem == "README" or f"({page.name})" in index, page.name


@pytest.mark.parametrize("page", HAND_WRITTEN, ids=lambda page: page.stem)
def test_paths_exist(page: Path) -> None:
    """Paths from the top of the checkout, in back quotes; `<name>` stands for any name.

    Pages that a command wrote say what was true when it did.
    """
    for path in re.findall(rf"`((?:{FOLDERS})/[^`\s]*)`", text_of(page)):
        if page.stem == "extending" and Path(path).stem == "heun":
            continue  # the method that the page adds
        for one in re.sub(r"<\w+>", "*", path).split(","):
            assert next(ROOT.glob(one.rstrip("/")), None) or one.endswith("_core.pyi"), path


COMMANDS = frozenset(typer.main.get_group(app).commands)


@every_page
def test_names_and_commands_exist(page: Path) -> None:
    """`hp.name`; in back quotes `hexapod_pin.room.name`, a module or a name in one; commands."""
    text = text_of(page)
    for name in re.findall(r"\bhp\.([A-Za-z_]\w*)", text):
        assert hasattr(hp, name), f"hp.{name}"
    for path in re.findall(r"`(hexapod_pin(?:\.\w+)+)", text):
        module, _, name = path.rpartition(".")
        try:
            importlib.import_module(path)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(module), name), path
    assert set(re.findall(r"`hexapod-pin ([a-z]+)", text)) <= COMMANDS


@pytest.mark.parametrize(
    "page",
    """cases.md closed_loop.md compare.md contact_laws.md drive.md foot_control.md interchange.md
    learning.md loads.md motors.md robots.md stability.md sweeps.md terrain.md uncertainty.md verdict.md
    walking.md""".split(),
)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    """The blocks of a page belong together: names of one are known in the next."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", text_of(ROOT / "docs" / page), re.DOTALL):
        exec(compile(block, page, "exec"), names)

"""The documents: links, paths, names and commands in them exist, and their examples run."""

from __future__ import annotations

import importlib
import re
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


@every_page
def test_links_lead_somewhere(page: Path) -> None:
    """Files and, behind a #, headings in them."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            path, _, anchor = target.partition("#")
            there = page.parent / path if path else page
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_index_names_every_page() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        assert page.stem == "README" or f"({page.name})" in index, page.name


@pytest.mark.parametrize("page", HAND_WRITTEN, ids=lambda page: page.stem)
def test_paths_exist(page: Path) -> None:
    """Paths from the top of the checkout, in back quotes; `<name>` stands for any name.

    Pages that a command wrote say what was true when it did.
    """
    for path in re.findall(rf"`((?:{FOLDERS})/[^`\s]*)`", page.read_text(encoding="utf-8")):
        if page.stem == "extending" and Path(path).stem == "heun":
            continue  # the method that the page adds
        for one in re.sub(r"<\w+>", "*", path).split(","):
            assert list(ROOT.glob(one.rstrip("/"))) or one.endswith("_core.pyi"), path


@every_page
def test_public_names_exist(page: Path) -> None:
    for name in re.findall(r"\bhp\.([A-Za-z_]\w*)", page.read_text(encoding="utf-8")):
        assert hasattr(hp, name), f"hp.{name}"


@every_page
def test_dotted_names_exist(page: Path) -> None:
    """`hexapod_pin.room.name`, in back quotes, is a module or a name in one."""
    for path in re.findall(r"`(hexapod_pin(?:\.\w+)+)", page.read_text(encoding="utf-8")):
        module, _, name = path.rpartition(".")
        try:
            importlib.import_module(path)
        except ModuleNotFoundError:
            assert hasattr(importlib.import_module(module), name), path


@every_page
def test_commands_exist(page: Path) -> None:
    known = set(typer.main.get_group(app).commands)
    text = page.read_text(encoding="utf-8")
    assert set(re.findall(r"`hexapod-pin ([a-z]+)", text)) <= known


@pytest.mark.parametrize(
    "page",
    """cases.md closed_loop.md compare.md contact_laws.md drive.md foot_control.md loads.md
    motors.md robots.md stability.md sweeps.md terrain.md uncertainty.md verdict.md
    walking.md""".split(),
)
def test_the_code_of_a_page_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The blocks of a page belong together: names of one are known in the next."""
    monkeypatch.chdir(tmp_path)
    text, names = (ROOT / "docs" / page).read_text(encoding="utf-8"), {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, page, "exec"), names)

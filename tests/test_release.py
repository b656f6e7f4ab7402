"""Files of a release agree: version, URLs, dependencies and systems are those of pyproject.toml."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import yaml

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]


def loaded(path: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))
    return found


def test_the_citation_agrees_with_the_project() -> None:
    citation = loaded("CITATION.cff")
    assert str(citation["version"]) == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert citation.get("repository-code") == PROJECT.get("urls", {}).get("Repository")
    assert re.search(
        rf"^## {re.escape(PROJECT['version'])} ", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE
    )


CONDA_NAMES = {"pin": "pinocchio", "meshcat": "meshcat-python"}


def test_the_conda_recipe_needs_what_the_project_needs() -> None:
    recipe = loaded("packaging/conda/recipe.yaml")
    assert recipe["context"]["version"] == PROJECT["version"]
    needed = {}
    for line in PROJECT["dependencies"]:
        name, bound = re.match(r"([\w-]+)([^;]*)", line).groups()  # type: ignore[union-attr]
        needed[CONDA_NAMES.get(name, name)] = bound.strip().removeprefix("==")
    given = dict(line.partition(" ")[::2] for line in recipe["requirements"]["run"])
    assert given == {"python": "", **needed}


def test_wheels_are_built_for_the_python_versions_of_the_project() -> None:
    built = PYPROJECT["tool"]["cibuildwheel"]["build"].split()
    least = int(PROJECT["requires-python"].removeprefix(">=3."))
    assert built == [f"cp3{minor}-*" for minor in range(least, least + len(built))]

"""Runs a study as a command: options from its signature, a page with machine and command, JSON."""

from __future__ import annotations

import argparse
import inspect
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.text_table import Table
from hexapod_pin.validation.machine import Machine, load

RESULTS = Path("docs") / "results"


@dataclass(frozen=True)
class StudyReport:
    """What a study found.

    Attributes:
        title: of the page.
        parts: paragraphs and tables, in order.
        data: what goes into a JSON file besides the machine; None for no such file.
        met: whether every target or limit was met that no cell of a table judges.
    """

    title: str
    parts: Sequence[str | Table]
    data: Mapping[str, Any] | None = None
    met: bool = True

    @property
    def failures(self) -> list[str]:
        """The rows of the tables with a cell that says FAIL or unexpected pass, joined."""
        tables = (part for part in self.parts if isinstance(part, Table))
        return [", ".join(row) for table in tables for row in table.texts() if any(map(fails, row))]


def fails(cell: str) -> bool:
    """Tell whether a cell of a table says that its row missed its number."""
    return cell.startswith(("FAIL", "unexpected pass")) or cell.endswith("FAIL")


def verdict(good: bool) -> str:
    """Return the word for a number that was or was not met."""
    return "pass" if good else "FAIL"


Study = Callable[..., StudyReport]


def run_study(study: Study, argv: Sequence[str] | None = None) -> int:
    """Run a study with the options of a command line; print its page and write its files.

    Args:
        study: its keyword arguments with a default (int, float, bool, str, Path) are the options;
            its name is that of the files.
        argv: the command line without the program; None: that of the process.

    Returns:
        The exit status: 1 where a target was missed; every row that says FAIL is one.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    options = vars(_parser(study).parse_args(words))
    folder = options.pop("out")
    name, machine = study.__name__, Machine.here()
    found = study(**options)
    shown = [word for k, word in enumerate(words) if "--out" not in (word, *words[k - 1 : k])]
    command = " ".join(["python", "scripts/studies", name, *shown])
    text = study_page(found, command, f"{machine} At the end {load():.2f}.")
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / f"{name}.md", text)
    if found.data is not None:
        data = {"command": command, "machine": asdict(machine), **found.data}
        write_atomically(folder / f"{name}.json", json.dumps(data, indent=1) + "\n")
    print(text)
    return 0 if found.met and not found.failures else 1


def study_page(found: StudyReport, command: str, machine: str) -> str:
    """Return the report as Markdown; command and machine stand in its head."""
    parts = [f"# {found.title}\n", f"`{command}`\n", f"{machine}\n"]
    for part in found.parts:
        if isinstance(part, str):
            parts.append(f"{part}\n")
        else:
            parts.append(f"## {part.title}\n\n{part.markdown()}" if part.title else part.markdown())
    return "\n".join(parts)


def _parser(study: Study) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=inspect.getdoc(study))
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the results")
    for name, parameter in inspect.signature(study).parameters.items():
        default, option = parameter.default, f"--{name.replace('_', '-')}"
        if isinstance(default, bool):
            parser.add_argument(option, action="store_true")
        else:
            parser.add_argument(option, type=type(default), default=default)
    return parser

"""The reference: a page for each room of public names, and one of the commands."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import typer.main

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from public_surface import MODULES, SURFACE, surface  # noqa: E402

import hexapod_pin as hp  # noqa: E402
from hexapod_pin.commands.app import app  # noqa: E402

WIDTH = 80


def api_pages() -> dict[str, str]:
    """Return the text of the page of each room, by its place on the site."""
    found, written = surface(), dict[str, str]()
    return {
        f"api/{room or 'hp'}.md": _room_page(room, found, written)
        for room in ("", *sorted({*MODULES, *SURFACE} - {""}))
    }


def _room_page(room: str, found: Mapping[str, Any], written: dict[str, str]) -> str:
    """Return the page of a room: what the module says, then each public name.

    Args:
        room: "" for `hp` itself.
        found: what each public name stands for.
        written: the name of each definition that has its entry on a page already; it is extended.
    """
    module = getattr(hp, room) if room else hp
    shown = f"hp.{room}" if room else "hp"
    if room in SURFACE:
        names = {n: found[f"{room}.{n}" if room else n] for n in SURFACE[room].split()}
    else:
        names = dict(_members(module))
    alone = "members: false\n      show_root_heading: false\n      show_root_toc_entry: false"
    parts = [f"# {shown}\n\n::: {module.__name__}\n    options:\n      {alone}\n"]
    elsewhere = []
    for name, item in names.items():
        inner = inspect.unwrap(item)
        path = f"{inner.__module__}.{inner.__qualname__}"
        if path in written:
            elsewhere.append(f"[`{written[path]}`][{path}]")
            continue
        written[path] = heading = f"{shown}.{name}"
        options = f"    options:\n      heading: {heading}\n      toc_label: {heading}\n"
        parts.append(f"::: {path}\n{options}")
    if elsewhere:
        parts.append(f"Also in this module: {', '.join(elsewhere)}.\n")
    return "\n".join(parts)


def _members(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Yield the public functions and classes of a module that has no list of its own."""
    for name in getattr(module, "__all__", None) or sorted(vars(module)):
        item = getattr(module, name)
        own = getattr(item, "__module__", "").startswith(module.__name__)
        if not name.startswith("_") and own and (inspect.isclass(item) or inspect.isfunction(item)):
            yield name, item


def commands_page() -> str:
    """Return the page of the commands: what each prints with `--help`."""
    group = typer.main.get_group(app)
    context = click.Context(group, info_name="hexapod-pin", terminal_width=WIDTH)
    parts = ["# Commands\n", "What each command prints with `--help`.\n", _help(group, context)]
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        inner = click.Context(command, context, info_name=name, terminal_width=WIDTH)
        parts += [f"## {name}\n", _help(command, inner)]
    return "\n".join(parts)


def _help(command: click.Command, context: click.Context) -> str:
    return f"```text\n{command.get_help(context).rstrip()}\n```\n"

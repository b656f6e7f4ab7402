"""The door of the command line: odd words for commands that end quickly."""

from __future__ import annotations

import contextlib
import io
import os
import random
import shlex
from collections.abc import Sequence
from functools import cache
from typing import Any

from fuzz import material
from fuzz.shown import FaultFound, require_finite
from fuzz.values import NUMBERS, odd_text
from fuzz.watched_folder import HAZARDS
from hexapod_pin.errors import HexapodError

WORDS = (
    "", "x", "nan", "-", "--", "a\0b", "é" * 300, "x/" * 3000, "~unknown/x", "/",
    "/dev/null", ".", "..", "*", "1e-4", "0.01",
)  # fmt: skip

STATUSES = {0, 1, 2, 3}
"""Done, failed, used wrongly, does not walk."""


LEFT_OUT = {"--help", "--force", "--show", "--hard", "--all", "--engines", "--peers", "--rounds"}
"""Options that ask for long work, or say what is said anyway."""

STIFF = {"--kp", "--kd", "--duration", "--advise", "--contact", "--cycle-time"}
"""Options of `bench` that make its references long work; what it is given of them stays."""


def command_line(rng: random.Random) -> None:
    """A command on one run with odd options."""
    _with_odd_options(rng.choice(_commands()), rng)


def study_line(rng: random.Random) -> None:
    """A command on many runs with odd options."""
    _with_odd_options(rng.choice(_study_commands()), rng)


def _with_odd_options(command: tuple[str, ...], rng: random.Random) -> None:
    from hexapod_pin.commands.app import main

    name, *words = odd_options(command, rng)
    shown, status = io.StringIO(), 0
    with _in_own_folder(), contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
        try:
            main([name, *words])
        except SystemExit as end:
            status = int(end.code or 0)
    if status not in STATUSES:
        raise FaultFound(f"status {status} of {name}", shlex.join([name, *words]))
    require_finite(shown.getvalue(), *words)
    if status in (1, 2):
        raise HexapodError(f"{name} {words} is refused")


def odd_options(command: Sequence[str], rng: random.Random) -> list[str]:
    """Return a command with a few odd options more, and perhaps a word changed."""
    name, *words = command
    left_out = LEFT_OUT | STIFF if name == "bench" else LEFT_OUT
    options = [one for one in _options().get(name, ()) if one not in left_out]
    for option in rng.sample(options, min(len(options), rng.choice((1, 1, 2, 3)))):
        words.append(option)
        if rng.random() < 0.8:
            words.append(str(rng.choice(rng.choice((NUMBERS, WORDS, HAZARDS)))))
    if words and rng.random() < 0.2:
        k = rng.randrange(len(words))
        if k == 0 or words[k - 1] not in left_out:
            words[k] = odd_text(words[k], rng)
    return [name, *words]


@cache
def _commands() -> list[tuple[str, ...]]:
    """Return commands with what they need."""
    trace = str(material.trace().save(material.folder() / "sound.nc"))
    case = material.folder() / "sound.toml"
    case.write_text(material.case_text(), encoding="utf-8")
    urdf = material.folder() / "sound.urdf"
    urdf.write_text(material.urdf_text(), encoding="utf-8")
    walk = ("walk", "kharagpur", "--duration", "0.02", "--quick", "--no-html")
    return [walk, walk, ("run", str(case), "--no-html"), ("budget", trace), ("stability", trace),
            ("check", str(urdf)), ("repair", str(urdf)), ("contact", "s1")]  # fmt: skip


@cache
def _study_commands() -> list[tuple[str, ...]]:
    """Return commands on many runs, with what they need."""
    case = material.folder() / "sound.toml"
    case.write_text(material.case_text(), encoding="utf-8")
    study = material.folder() / "study.toml"
    short = material.STUDY_TEXT.replace("duration = 1.0", "duration = 0.02")
    study.write_text(short, encoding="utf-8")
    bench = ("bench", "kharagpur", "--quick", "--methods", "rk4", "--duration", "0.02",
             "--rounds", "1")  # fmt: skip
    compare = ("compare", str(case), "--controllers", "conventional,slip")
    return [compare, compare, ("compare", str(case), "--bumps", "0.01", "--seeds", "1"),
            ("sweep", str(study)), ("sweep", str(study), "--resume"), bench,
            ("verify", "--only", "gait-form")]  # fmt: skip


@cache
def _options() -> dict[str, list[str]]:
    """Return the options of each command."""
    import typer

    from hexapod_pin.commands.app import app

    group: Any = typer.main.get_command(app)
    return {
        name: [option for one in command.params for option in one.opts if option.startswith("--")]
        for name, command in group.commands.items()
    }


@contextlib.contextmanager
def _in_own_folder() -> Any:
    """Work in the folder of this process that is looked at."""
    before = os.getcwd()
    os.chdir(material.watched().work)
    try:
        yield
    finally:
        os.chdir(before)

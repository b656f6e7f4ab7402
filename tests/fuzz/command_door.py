"""The door of the command line: odd words for commands in this process."""

from __future__ import annotations

import contextlib
import io
import os
import random
import shlex

from fuzz import material
from fuzz.command_input import COMMANDS, odd_options, write_sound_files
from fuzz.shown import FaultFound, require_finite
from hexapod_pin.errors import HexapodError

STATUSES = {0, 1, 2, 3}
"""Done, failed, used wrongly, does not walk."""

LONG = ("view", "--processes")
"""What stays until Ctrl-C, and starts processes."""


def command_line(rng: random.Random) -> None:
    """A command with odd options."""
    from hexapod_pin.commands.app import main

    sound = rng.choice([words for words in COMMANDS if not {*LONG} & {*words}])
    words, shown, status = odd_options(sound, rng), io.StringIO(), 0
    tree, before = material.watched(), os.getcwd()
    tree.clear()
    write_sound_files(tree.work)
    os.chdir(tree.work)
    try:
        with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
            main(words)
    except SystemExit as end:
        status = int(end.code or 0)
    finally:
        os.chdir(before)
    if status not in STATUSES:
        raise FaultFound(f"status {status} of {shlex.join(words)}")
    require_finite(shown.getvalue(), *words)
    if status in (1, 2):
        raise HexapodError(f"{words} is refused")

"""What a terminal shows: what is being done, before any library that takes time; and tables."""

from __future__ import annotations

import errno
import io
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hexapod_pin.commands import app
from hexapod_pin.commands.progress import progress_bar, time_left_bar
from hexapod_pin.commands.terminal import announce, announce_command, settle
from hexapod_pin.text_table import Table, cell_text, fit_tables

HEAVY = {"typer", "pydantic", "numpy", "scipy", "pinocchio", "rich", "h5py"}


class Terminal(io.StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True


def on_terminal(folder: Path, *arguments: str) -> list[str]:
    """Run `hexapod-pin` on a terminal; return what it prints there and, in between, its imports."""
    reader, terminal = os.openpty()
    command = [sys.executable, "-X", "importtime", "-m", "hexapod_pin", *arguments]
    nothing = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=folder, stdin=nothing, stdout=nothing, stderr=terminal):
        os.close(terminal)
        parts = []
        try:
            while part := os.read(reader, 65536):
                parts.append(part)
        except OSError as error:  # of Linux, where the other end was closed
            assert error.errno == errno.EIO
        os.close(reader)
    return [line.rpartition("|")[2].strip() for line in b"".join(parts).decode().splitlines()]


def test_the_first_line_comes_before_the_libraries_and_the_second_before_numpy(tmp_path) -> None:
    lines = on_terminal(tmp_path, "walk", "none.urdf")
    first = lines.index("walk: loading libraries ...")
    assert "hexapod_pin.commands.terminal" in lines[:first]
    assert not {name.partition(".")[0] for name in lines[:first]} & HEAVY
    assert first < lines.index("typer") < lines.index("reading none.urdf ...")
    assert lines.index("reading none.urdf ...") < lines.index("numpy")


def test_seconds_are_counted_until_something_else_is_printed(monkeypatch) -> None:
    """A line that does not move for seconds looks like a command that hangs."""
    monkeypatch.setattr(sys, "stderr", Terminal())
    announce("reading robot.urdf")
    time.sleep(1.3)
    assert sys.stderr.getvalue() == "reading robot.urdf ...\n\r  1 s"
    announce("planning the gait")
    settle()
    announce_command(["walk", "--help"])
    assert sys.stderr.getvalue().split("\r")[-1] == "planning the gait ...\n"


ARGUMENTS = {
    "walk": ["none.urdf"], "run": ["none.toml"], "compare": ["none.toml"], "sweep": ["none.toml"],
    "view": ["none.nc"], "budget": ["none.nc"], "select": ["none.urdf"], "stability": ["none.nc"],
    "check": ["none.urdf"], "repair": ["none.urdf", "-o", "new.urdf"], "bench": ["none.urdf"],
    "export": ["none.urdf", "new.xml"],
}  # fmt: skip
COMPUTING = {"contact", "verify"}
"""These read no file; `verify` has a bar from its first check."""


def test_every_command_says_what_it_reads_first(tmp_path: Path, monkeypatch) -> None:
    assert set(app._commands().commands) == {*ARGUMENTS, *COMPUTING}
    monkeypatch.chdir(tmp_path)
    for command, arguments in ARGUMENTS.items():
        monkeypatch.setattr(sys, "stderr", Terminal())
        with pytest.raises(SystemExit):
            app.main([command, *arguments])
        assert sys.stderr.getvalue().startswith(f"reading {arguments[0]} ...\n"), command
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    announce("reading robot.urdf")
    assert sys.stderr.getvalue() == ""


def test_long_work_prints_lines_where_no_terminal_is(monkeypatch, capsys) -> None:
    """After 10 s, then every minute; the time left follows from the part done since the start."""
    now = [100.0]
    monkeypatch.setattr("hexapod_pin.commands.progress.time.monotonic", lambda: now[0])
    for bar in (progress_bar("motors", left=True), time_left_bar("sweep")):
        with bar as show:
            for second, fraction in ((0, 0.2), (8, 0.25), (20, 0.3), (70, 0.4), (80, 0.6)):
                now[0] = 100.0 + second
                show(fraction)
        now[0] = 100.0
    lines = ["30% done, about 2 min left", "60% done, about 80 s left"]
    lines = [f"{title}: {line}" for title in ("motors", "sweep") for line in lines]
    assert capsys.readouterr().err.splitlines() == lines


# Tables as text: alignment, titles in lines, numbers, what is missing, and Markdown.

ROWS = [("coxa", 1.25, 3), ("femur, left", math.nan, None), ("tibia", 123456.0, -1)]


def test_columns_are_aligned_below_titles_in_lines():
    """The first column to the left, the others to the right; a title's last lines stand low."""
    table = Table("Need", ("joint", "peak\n[N m]", "steps"), ROWS, "<>")
    assert table.lines() == [
        "Need",
        "                  peak       ",
        "joint            [N m]  steps",
        "-----------------------------",
        "coxa              1.25      3",
        "femur, left          -      -",
        "tibia        1.235e+05     -1",
    ]
    table = Table("", ("", ""), ROWS, number=".2g", missing="unknown")
    assert table.texts()[:2] == [["coxa", "1.2", "3"], ["femur, left", "unknown", "unknown"]]
    assert [cell_text(x) for x in (math.inf, 12345, "as it is")] == ["inf", "12345", "as it is"]


def test_markdown_has_sides_and_escapes_bars():
    table = Table("not in it", ("|F|\n[N]", "b", "c"), [("a|b", 1.0, None)], "<>")
    assert table.markdown() == (
        "| \\|F\\| [N] | b | c |\n| --- | ---: | ---: |\n| a\\|b | 1 | - |\n"
    )


def test_a_table_fits_the_terminal():
    """A column of texts is folded where that is enough; other columns go below, with the first."""
    words = "the joint of the left leg in front"
    with fit_tables(40):
        folded = Table("", ("what", "peak\n[N m]"), [(words, 1.25), ("tibia", 3.0)], "<>").lines()
        blocks = Table("", ("t", *"abcde"), [("u", *5 * ["1234567890"])]).lines()
    assert folded == [
        "                                    peak",
        "what                               [N m]",
        40 * "-",
        "the joint of the left leg in        1.25",
        "  front                                 ",
        "tibia                                  3",
    ]
    assert max(map(len, blocks)) <= 40 and blocks.count("") == 1
    assert [line.split()[0] for line in blocks if line] == ["t", 37 * "-", "u", "t", 25 * "-", "u"]
    assert max(map(len, Table("", ("what",), [(words * 3,)]).lines())) == 3 * len(words)

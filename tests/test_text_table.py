"""Tables as text: alignment, titles in lines, numbers, what is missing, and Markdown."""

from __future__ import annotations

import math

from hexapod_pin.text_table import Table, cell_text, fit_tables

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

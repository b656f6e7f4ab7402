"""Names from files reach terminal, catalogue and spreadsheet as text, never as an instruction."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import hexapod_pin.commands
from hexapod_pin.commands.terminal import echo

COMMANDS = Path(hexapod_pin.commands.__file__).parent


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", r"\x1b]0;title\x07"),
        ("\x9b31m \x7f \r", r"\x9b31m \x7f \x0d"),
        ("a\u202eb\u2066c\u200fd\u2028e", r"a\u202eb\u2066c\u200fd\u2028e"),
        ("a file \udcff", r"a file \udcff"),
        ("tab\tand\nline, Å 汉 🦗 \\x1b", "tab\tand\nline, Å 汉 🦗 \\x1b"),
    ],
)
@pytest.mark.parametrize("err", [False, True])
def test_a_terminal_is_given_no_control_characters(
    text: str, shown: str, err: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """What a terminal acts on is printed as an escape; everything else as it is."""
    echo(text, err=err)
    assert capsys.readouterr()[err] == f"{shown}\n"


PRINTING = {"print", "echo", "secho", "echo_via_pager", "write", "writelines"}


def _prints(node: ast.AST) -> bool:
    """Whether a call prints by itself: `print(..)`, `typer.echo(..)`, `sys.stdout.write(..)`."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Name):
        return node.func.id == "print"
    owner = getattr(node.func, "value", None)
    name = getattr(node.func, "attr", "")
    if name in {"write", "writelines"}:
        return ast.unparse(owner).startswith("sys.") if owner else False
    return name in PRINTING and ast.unparse(owner) in {"typer", "click"} if owner else False


def test_commands_print_at_one_place() -> None:
    """No command prints but through `hexapod_pin.commands.terminal`."""
    found = [
        f"{path.name}:{node.lineno}"
        for path in sorted(COMMANDS.glob("*.py"))
        if path.name != "terminal.py"
        for node in ast.walk(ast.parse(path.read_text()))
        if _prints(node)
    ]
    assert not found

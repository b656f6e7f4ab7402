"""Names from files reach terminal, catalogue and spreadsheet as text, never as an instruction."""

from __future__ import annotations

import ast
import csv
import io
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import Run
from matplotlib.figure import Figure
from matplotlib.text import Text
from synthetic import synthetic_trace, with_run

import hexapod_pin as hp
import hexapod_pin.commands
from hexapod_pin.benchmark.report import BenchmarkReport, csv_text, write_report
from hexapod_pin.commands.progress import progress_bar, time_left_bar
from hexapod_pin.commands.terminal import echo
from hexapod_pin.drive.catalog import Catalog, MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import CatalogError, ParameterError
from hexapod_pin.results.motor_candidate import KindUse, MotorCandidate
from hexapod_pin.results.motor_selection import MotorSelection, write_selection_csv
from hexapod_pin.results.result_files import Column
from hexapod_pin.study.runs.sweep_result import sweep_csv
from hexapod_pin.validation.machine import Machine
from hexapod_pin.view import html
from hexapod_pin.view.figure_file import figure_bytes, settle_layout
from hexapod_pin.view.map_figures import draw_gait_energy

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
def test_a_terminal_is_given_no_control_characters(text, shown, err, capsys):
    """What a terminal acts on is printed as an escape; everything else as it is."""
    echo(text, err=err)
    assert capsys.readouterr()[err] == f"{shown}\n"


@pytest.mark.parametrize(
    "options",
    [
        ("\x1b[31m\u202e",), ("--\x1b[31m\u202e",), ("walk", "a", "b\x1b[31m\u202e"),
        ("walk", "--\x9b\u202e"), ("walk", "\x1b]0;title\x07\u202e"),
        ("walk", "kharagpur", "--gait", "\x1b[31m\u202e"), ("verify", "--only", "\x1b[31m\u202e"),
    ],
)  # fmt: skip
def test_arguments_are_quoted_visibly(options: tuple[str, ...], run: Run) -> None:
    """In the error of a command line that cannot be understood, and of a wrong value."""
    found = run(*options)
    assert found.status == 2
    assert r"\u202e" in found.err
    assert not set("\x07\x1b\x9b\u202e") & set(found.out + found.err)


def test_titles_and_notes_are_texts(monkeypatch, capsys):
    """Neither control characters nor square brackets of a name are acted on; meshes not drawn."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "200")
    for bar in (progress_bar, time_left_bar):
        with bar("\x1b]0;title\x07[bold]\u202e") as show:
            show(0.0)
            show(0.5)
        shown = capsys.readouterr().err
        assert r"\x1b]0;title\x07[bold]\u202e" in shown
        assert not set("\x07\u202e") & set(shown)
    found = SimpleNamespace(notes=["\x1b[31m\u202e.stl"], url="http://127.0.0.1:1/")
    monkeypatch.setattr(html, "live_viewer", lambda *_, **__: nullcontext(found))
    html.view(synthetic_trace(duration=0.1), duration=0.0, open_browser=False)
    assert r"\x1b[31m\u202e.stl" in capsys.readouterr().out


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


def _fault(exception: pytest.ExceptionInfo[CatalogError]) -> tuple[int, str, object]:
    return exception.value.line, exception.value.column, exception.value.value


@pytest.mark.parametrize(
    ("row", "column", "value"),
    [
        ("A\x1b]0;title\x07,maker,x", "model", "A\x1b]0;title\x07"),
        ("A\u202e,maker,x", "model", "A\u202e"), ('"A\nB",maker,x', "model", "A\nB"),
        ("A\tB,maker,x", "model", "A\tB"), ("A,\x9b31mROBOTIS,x", "maker", "\x9b31mROBOTIS"),
        ('A,maker,"page\x7f 2"', "note", "page\x7f 2"),
    ],
)  # fmt: skip
def test_a_catalogue_with_control_characters_is_refused(row, column, value, tmp_path):
    """The row is named with its line and column, and nothing is printed raw."""
    path = tmp_path / "motors.csv"
    head = "voltage_V,stall_torque_Nm,no_load_speed_rad_s,mass_kg,model,maker,note"
    path.write_text(f"{head}\n12,1.5,6,0.05,OK,,\n12,1.5,6,0.05,{row}\n", encoding="utf-8")
    with pytest.raises(CatalogError) as refused:
        hp.load_catalog(path)
    assert _fault(refused) == (3, column, value)
    with pytest.raises(ParameterError) as wrong:
        MotorRecord(**{"model": "A", column: value}, voltage=12.0, stall_torque=1.5)
    assert wrong.value.name.endswith(column)


@pytest.mark.parametrize("note", ["two\nlines\tand a tab", "Å, 汉, 5 °C, “x”", "'quoted'"])
def test_a_catalogue_with_other_text_is_read(note: str, tmp_path: Path) -> None:
    """Lines and tabs within a note, and every other script, stay as they are."""
    record = MotorRecord(model="A", voltage=12.0, stall_torque=1.5, note=note)
    (again,) = hp.load_catalog(Catalog((record,), "").save(tmp_path / "motors.csv"))
    assert again == record


FORMULAS = [
    '=HYPERLINK("http://example.org")', "+1+cmd", "-2+3", "@SUM(A1)", "'=1", "''-1", "\t=1",
]  # fmt: skip


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_stays_a_text(text: str, tmp_path: Path) -> None:
    """In a catalogue and in tables; what is read back is the same, numbers stay numbers."""
    text = text.strip()
    record = MotorRecord(model=text, maker=text, voltage=12.0, stall_torque=1.5, note=text)
    path = Catalog((record,), "").save(tmp_path / "motors.csv")
    cells = [cell for row in csv.reader(path.read_text().splitlines()) for cell in row]
    assert not [cell for cell in cells if cell[:1] in {"=", "+", "-", "@", "\t", "\r"}]
    (again,) = hp.load_catalog(path)
    assert again == record
    case = Column(("case",), np.arange(1), {})
    columns = {
        "case": case,
        text: Column(("case",), np.array([-0.5]), {"units": "m"}),
        "reason": Column(("case",), np.array([text], dtype=object), {}),
    }
    head, row = csv.reader(io.StringIO(sweep_csv(columns).decode(), newline=""))
    assert head == ["case", f"'{text} [m]", "reason"]
    assert row == ["0", "-0.5", f"'{text}"]

    found = chosen(text.strip())
    path = write_selection_csv(found, tmp_path / "motors.csv")
    (cells,) = csv.DictReader(path.read_text().splitlines())
    assert cells["motor"] == cells["source"] == cells["kind of joint"] == f"'{text.strip()}"
    assert float(cells["robot mass [kg]"]) == 3.2


def test_an_unpaired_surrogate_is_an_escape_in_tables_and_pages(tmp_path: Path) -> None:
    case = Column(("case",), np.arange(1), {})
    columns = {"case": case, "reason": Column(("case",), np.array(["a\ud800"], dtype=object), {})}
    assert r"a\ud800" in sweep_csv(columns).decode()
    found = chosen("M1")
    use = replace(found.candidates[0].uses[0], reasons=("a\ud800",))
    found = replace(found, candidates=(replace(found.candidates[0], uses=(use,)),))
    assert r"a\ud800" in write_selection_csv(found, tmp_path / "m.csv").read_text("utf-8")
    report = BenchmarkReport(Machine.here(), "bench a\ud800", ())
    assert r"a\ud800" in write_report(report, tmp_path / "a.md").read_text("utf-8")
    trace = synthetic_trace(duration=0.1)
    names = tuple(f"{name}\ud800" for name in trace.joint_names)
    replace(trace, joint_names=names).save(tmp_path / "a.csv")
    assert rf"{names[0][:-1]}\ud800" in (tmp_path / "a.csv").read_text("utf-8")
    facts = trace.run.robot.model_copy(update={"name": "a\ud800"})  # which a file cannot have
    odd = with_run(trace, robot=facts)
    assert r"a\ud800" in html.write_html(odd, tmp_path / "a.html").read_text("utf-8")


def test_remarks_of_a_table_stay_in_their_lines() -> None:
    """A file's name may hold a newline: what follows it is no row."""
    lines = csv_text(BenchmarkReport(Machine.here(), "bench a\n=1\r=2\u2028=3", ())).splitlines()
    assert [line[0] for line in lines] == ["#", "#", "s"]


def chosen(text: str) -> MotorSelection:
    """Return a selection of one motor that is called so, as its joints are."""
    motor = MotorRecord(model=text, voltage=12.0, stall_torque=4.0, mass=0.08, source=text)
    use = KindUse(text, 0.3, 0.4, 0.3, 0.0, 0.2, 0.0, 0.0, {}, (text,))
    candidate = MotorCandidate({text: motor}, 3.2, 0.96, (use,), ())
    return MotorSelection(
        robot_name=text, total_mass=3.0, contained=0.06, walks=(text,), candidates=(candidate,),
        unusable=(),
        choice=candidate, iterations=(), confidence=None, derating=Derating(), catalog=text,
        assumed=(), notes=(), demands={},
    )  # fmt: skip


def test_a_file_cannot_hold_an_unpaired_surrogate(tmp_path: Path) -> None:
    """HDF5 raises a UnicodeEncodeError of its own."""
    with pytest.raises(ParameterError) as caught:
        costs("tripod \ud800").save(tmp_path / "a.nc")
    assert "tripod \ud800" in caught.value.value and "surrogates" in caught.value.allowed
    assert list(tmp_path.iterdir()) == []


NAMES = {
    r"$\frac$": r"$\frac$",  # of a formula, which matplotlib cannot read
    "$a$ $b": "$a$ $b",
    "a\x1b]0;b\x07": r"a\x1b]0;b\x07",
    "a\ud800": r"a\ud800",
    "\u4e2d": "\u4e2d",  # which the font lacks: of that matplotlib warns
}
"""What names are drawn as."""


def test_names_in_figures_are_drawn_as_they_are() -> None:
    """In legends and ticks; a warning would be an error here."""
    found = draw_gait_energy(costs(*NAMES), costs=("torque_index",))
    ticks = Figure()
    axes = ticks.subplots()
    axes.set_xticks(range(len(NAMES)), NAMES)
    axes.set_yscale("log")
    for figure in (found, ticks):
        images = {ending: figure_bytes(figure, ending) for ending in ("svg", "png")}
        texts = [text.get_text() for text in figure.findobj(Text)]
        assert all(any(drawn in text for text in texts) for drawn in NAMES.values())
        assert images["svg"].count(b"frac") == 1
    powers = [text.get_text() for text in axes.get_yticklabels()]
    assert any("10^{" in text for text in powers)  # those of a logarithmic axis stay formulas


@pytest.mark.parametrize("name", NAMES)
def test_a_layout_is_settled_whatever_the_names_are(name: str) -> None:
    """As that of a report's pictures, before they are drawn."""
    figure = Figure(layout="constrained")
    figure.subplots().set_title(name)
    settle_layout(figure)
    assert figure.axes[0].get_title() == NAMES[name]


def costs(*names: str) -> hp.study.GaitEnergy:
    """Return the energy of gaits that are called so."""
    gaits = dict.fromkeys(names, hp.Gait.tripod())
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.study.gait_energy(scene, gaits, (0.05,), accuracy=1e-2, check=0)

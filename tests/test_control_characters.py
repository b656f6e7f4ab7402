"""Names from files reach terminal, catalogue and spreadsheet as text, never as an instruction."""

from __future__ import annotations

import ast
import csv
import io
import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import Run
from matplotlib.figure import Figure
from matplotlib.text import Text
from refusals import refused
from synthetic import synthetic_trace, with_run

import hexapod_pin as hp
import hexapod_pin.commands
from hexapod_pin.benchmark.report import BenchmarkReport, csv_text
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


def test_a_terminal_is_given_no_control_characters(capsys):
    """What a terminal acts on is printed as an escape; everything else as it is."""
    for text, shown in {
        "\x1b]0;title\x07 \x9b31m \x7f \r": r"\x1b]0;title\x07 \x9b31m \x7f \x0d",
        "a\u202eb\u2066c\u200fd\u2028e": r"a\u202eb\u2066c\u200fd\u2028e",
        "a file \udcff": r"a file \udcff",
        "tab\tand\nline, Å 汉 🦗 \\x1b": "tab\tand\nline, Å 汉 🦗 \\x1b",
    }.items():
        echo(text)
        echo(text, err=True)
        assert capsys.readouterr() == (f"{shown}\n", f"{shown}\n")


def test_arguments_are_quoted_visibly(run: Run) -> None:
    """In the error of a command line that cannot be understood, and of a wrong value."""
    for options in (("\x1b[31m\u202e",), ("walk", "kharagpur", "--gait", "\x9b31m\u202e")):
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


def test_commands_print_at_one_place() -> None:
    """No command prints but through `hexapod_pin.commands.terminal`."""
    printing = re.compile(r"print|(typer|click)\.(secho|echo\w*)|sys\..*\.writ\w+")
    for path in Path(hexapod_pin.commands.__file__).parent.glob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text())) if path.name != "terminal.py" else ()
        called = [ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)]
        assert not [name for name in called if printing.fullmatch(name)], path


@pytest.mark.parametrize(
    ("row", "column", "value"),
    [
        ("A\x1b]0;title\x07,maker,x", "model", "A\x1b]0;title\x07"),
        ('"A\nB",maker,x', "model", "A\nB"), ('A,maker,"page\u202e"', "note", "page\u202e"),
    ],
)  # fmt: skip
def test_a_catalogue_with_control_characters_is_refused(row, column, value, tmp_path):
    """The row is named with its line and column, and nothing is printed raw."""
    path = tmp_path / "motors.csv"
    head = "voltage_V,stall_torque_Nm,no_load_speed_rad_s,mass_kg,model,maker,note"
    path.write_text(f"{head}\n12,1.5,6,0.05,OK,,\n12,1.5,6,0.05,{row}\n", encoding="utf-8")
    with refused(CatalogError, line=3, column=column, value=value):
        hp.load_catalog(path)
    with refused(ParameterError, column):
        MotorRecord(**{"model": "A", column: value}, voltage=12.0, stall_torque=1.5)


@pytest.mark.parametrize(
    "text",
    ['=HYPERLINK("http://example.org")', "+1+cmd", "-2+3", "@SUM(A1)", "'=1", "''-1"],
)
def test_a_formula_stays_a_text(text: str, tmp_path: Path) -> None:
    """In a catalogue and in tables; what is read back is the same, numbers stay numbers."""
    note = f"{text}\nlines\tand a tab, Å, 汉, 5 °C, “x”"
    record = MotorRecord(model=text, maker=text, voltage=12.0, stall_torque=1.5, note=note)
    path = Catalog((record,), "").save(tmp_path / "motors.csv")
    with path.open(encoding="utf-8", newline="") as stream:
        cells = [cell for row in csv.reader(stream) for cell in row]
    assert not [cell for cell in cells if cell[:1] in {"=", "+", "-", "@", "\t", "\r"}]
    (again,) = hp.load_catalog(path)
    assert again == record
    columns = {
        **column("case", np.arange(1)),
        text: Column(("case",), np.array([-0.5]), {"units": "m"}),
        **column("reason", np.array([text], dtype=object)),
    }
    head, row = csv.reader(io.StringIO(sweep_csv(columns).decode(), newline=""))
    assert head == ["case", f"'{text} [m]", "reason"]
    assert row == ["0", "-0.5", f"'{text}"]
    path = write_selection_csv(chosen(text), tmp_path / "motors.csv")
    (found,) = csv.DictReader(path.read_text().splitlines())
    assert found["motor"] == found["source"] == found["kind of joint"] == f"'{text}"
    assert float(found["robot mass [kg]"]) == 3.2


def column(name: str, values: np.ndarray) -> dict[str, Column]:
    return {name: Column(("case",), values, {})}


def test_an_unpaired_surrogate_is_an_escape_in_tables_and_pages(tmp_path: Path) -> None:
    reasons = column("reason", np.array(["a\ud800"], dtype=object))
    assert r"a\ud800" in sweep_csv(column("case", np.arange(1)) | reasons).decode()
    trace = synthetic_trace(duration=0.1)
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
    with refused(ParameterError, about=("surrogates",)) as caught:
        costs("tripod \ud800").save(tmp_path / "a.nc")
    assert "tripod \ud800" in caught.value.value
    assert list(tmp_path.iterdir()) == []


NAMES = {
    r"$\frac$": r"$\frac$",  # of a formula, which matplotlib cannot read
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
    for name, drawn in NAMES.items():  # as of a report's pictures, before they are drawn
        titled = Figure(layout="constrained")
        titled.subplots().set_title(name)
        settle_layout(titled)
        assert titled.axes[0].get_title() == drawn
    for figure in (found, ticks):
        images = {ending: figure_bytes(figure, ending) for ending in ("svg", "png")}
        texts = [text.get_text() for text in figure.findobj(Text)]
        assert all(any(drawn in text for text in texts) for drawn in NAMES.values())
        assert images["svg"].count(b"frac") == 1
    powers = [text.get_text() for text in axes.get_yticklabels()]
    assert any("10^{" in text for text in powers)  # those of a logarithmic axis stay formulas


def costs(*names: str) -> hp.study.GaitEnergy:
    gaits = dict.fromkeys(names, hp.Gait.tripod())
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.study.gait_energy(scene, gaits, (0.05,), accuracy=1e-2, check=0)

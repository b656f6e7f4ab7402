"""The report of a motor selection: safe, whole and repeatable; what notebooks show."""

from __future__ import annotations

import errno
import html
import math
import os
import re
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp

pytest.importorskip("matplotlib")

from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import NotRecordedError, ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.results.motor_candidate import KindUse, MotorCandidate, WalkRun
from hexapod_pin.results.motor_selection import Confidence, MotorSelection
from hexapod_pin.results.sizing import JointDemand
from hexapod_pin.view.report import Header, Table
from hexapod_pin.view.selection_report import selection_blocks, write_selection_report
from hexapod_pin.view.selection_tables import use_text, verdict_level, verdict_word
from tests.synthetic import synthetic_trace, with_run

COMMAND = "hexapod-pin select 'my robot' --voltage 12"
KINDS = ("coxa", "femur")
WALKS = ("tripod", "wave, payload 0.3 kg")


def record(model: str, stall: float = 4.0, **other: object) -> MotorRecord:
    given = {"no_load_speed": 5.0, "stall_current": 2.0, "mass": 0.08, "source": "data sheet 7"}
    return MotorRecord(model=model, voltage=12.0, stall_torque=stall, **{**given, **other})


def candidate(motor: MotorRecord, peak: float, holding: float = 0.3) -> MotorCandidate:
    reasons = ("femur torque is too large (tripod)",) if peak > 1.0 else ()
    uses = tuple(
        KindUse(kind, value, 0.4, holding, math.nan, 0.2, 0.0, math.nan,
                {"peak_use": WALKS[1]}, reasons if kind == "femur" else ())
        for kind, value in (("coxa", 0.3), ("femur", peak))
    )  # fmt: skip
    runs = tuple(WalkRun(walk, True, f"walks {walk}") for walk in WALKS)
    return MotorCandidate(
        dict.fromkeys(KINDS, motor), 3.2, 0.96, uses, runs, battery_current_peak=4.5
    )


def demand(scale: float = 1.0) -> JointDemand:
    time = np.linspace(0.0, 2.0, 201)
    phase = 2.0 * np.pi * time[:, None] + np.array([0.0, 1.0])
    return JointDemand.of_samples(
        time, scale * np.sin(phase), 2.0 * np.cos(phase + 0.4),
        joint_names=("lf_coxa", "lf_femur"), joint_kinds=KINDS, cycles=2,
    )  # fmt: skip


CONFIDENCE = Confidence(
    sentence="M1 at 12 V passes with 97 % confidence; friction decides (total index 0.71).",
    walk="tripod", share=0.97, low=0.95, high=0.99, walks=4,
    indices={"mu": 0.71, "mass": 0.2},
    percentiles={"5 %": 0.5, "50 %": 0.7, "95 %": 0.97, "99 %": 1.02},
    inputs=("mu: uniform 0.4 to 0.9",), values=(0.5, 0.7, 1.02, math.nan),
)  # fmt: skip


def selection(**changes: object) -> MotorSelection:
    peaks = {"M1": 0.8, "M2": 0.6, "M3": 1.7}
    ranked = tuple(candidate(record(model), peak) for model, peak in peaks.items())
    given = {
        "robot_name": "six legs", "total_mass": 3.0, "contained": 0.06, "walks": WALKS,
        "candidates": ranked, "unusable": (("M9 at 6 V", "no mass is known"),), "choice": ranked[0],
        "iterations": ranked[:1], "confidence": CONFIDENCE, "derating": Derating(),
        "catalog": "motors.csv", "assumed": ("rubber feet",), "notes": ("read this",),
        "demands": {WALKS[0]: demand(), WALKS[1]: demand(1.5)},
    }  # fmt: skip
    return MotorSelection(**{**given, **changes})  # type: ignore[arg-type]


def texts(s: MotorSelection) -> str:
    found: list[str] = []
    for block in selection_blocks(s):
        if isinstance(block, Header):
            found += [block.title, block.verdict.word, *block.verdict.texts]
            found += [text for fact in block.facts for text in fact]
        else:
            if isinstance(block, Table):
                found += [column.title for column in block.columns]
                found += [" | ".join(cell.text for cell in row) for row in block.rows]
            values = [x for x in vars(block).values() if not callable(x)]
            for row in (row for x in values for row in (x if isinstance(x, tuple) else (x,))):
                found += [str(x) for x in (row if isinstance(row, tuple) else (row,))]
    return "\n".join(found)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    evil = replace(CONFIDENCE, sentence='<script>alert("1")</script> & $x_2$')
    s = selection(confidence=evil, robot_name="<b>robot</b>", notes=("a <i>note</i> of 5 > 3",))
    path = tmp_path_factory.mktemp("report") / "motors.html"
    assert write_selection_report(s, path, date="2020-02-02", command=COMMAND) == path
    return s, path.read_bytes()


def test_a_page_holds_its_figures_and_refers_to_nothing_else(page, tmp_path):
    text = page[1].decode()
    assert len(re.findall('<img [^>]*src="data:image/svg\\+xml;base64,', text)) == 5
    assert not re.search(r"@import|url\(|<(link|iframe|object|i)\b", text)
    references = re.findall(r"""\s(?:src|href|srcset)=["']?([^"' >]*)""", text)
    assert all(one.startswith("data:image") for one in references)
    assert text.count("<script") == 1 and len(text) < 2_000_000
    shown = html.unescape(re.sub("<[^>]*>", "", text))
    for wanted in (
        "Motor selection: <b>robot</b>", '<script>alert("1")</script> & $x_2$', "2020-02-02",
        COMMAND, f"hexapod-pin {hp.__version__}",
    ):  # fmt: skip
        assert wanted in shown
    again = write_selection_report(page[0], tmp_path / "b.html", date="2020-02-02", command=COMMAND)
    assert again.read_bytes() == page[1]


def test_a_low_confidence_and_two_voltages_do_not_look_like_a_pass():
    mixed = {"coxa": record("M1"), "femur": record("M2").model_copy(update={"voltage": 14.8})}
    choice = replace(candidate(record("M1"), 0.8), motors=mixed)
    s = selection(choice=choice, confidence=replace(CONFIDENCE, share=0.53))
    assert (verdict_word(s), verdict_level(s)) == ("PASSES, WITH 53 % CONFIDENCE", "open")
    assert "These motors need 12 V and 14.8 V: one battery alone does not serve" in texts(s)


def test_everything_an_auditor_asks_for_is_there():
    found = texts(selection())
    for text in (
        "PASSES", "Choice: M1 at 12 V. They carry every joint on all 2 walks",
        "is 0.80, a margin of 20 %; what decides is the peak torque of the femur",
        "(wave, payload 0.3 kg)", CONFIDENCE.sentence, "1.70 *",
        "M3 at 12 V | femur: femur torque is too large (tripod)", "M9 at 6 V: no mass is known",
        "tripod | pass | walks tripod", *Derating().evidence, "rubber feet", "read this",
        "data sheet 7", "assumed: " + record("M1").assumed[0], "mu: uniform 0.4 to 0.9",
        "1 did not walk and count as failing", "3.20 kg (+0.20 kg against its file)",
    ):  # fmt: skip
        assert text in found, text


def test_what_is_unknown_says_so_and_nothing_is_nan():
    ranked = (candidate(record("M1"), 0.8, holding=math.nan),)
    found = texts(selection(candidates=ranked, choice=ranked[0], confidence=None, demands={}))
    for text in (
        "PASSES WHAT COULD BE JUDGED", "Holding torque, use [-] | unknown | unknown",
        "Not judged, because unknown: holding torque (coxa, femur)", "Price of all\nunknown",
        "no confidence is stated",
    ):  # fmt: skip
        assert text in found, text
    assert not re.search(r"\b(nan|NaN|None|inf)\b", found)
    assert [use_text(x) for x in (0.9988, 1.0004, 1.0)] == ["0.999", "1.0004", "1.00"]


def test_no_motor_that_passes_and_an_interrupted_run():
    ranked = (candidate(record("M3"), 1.7), candidate(record("M4"), math.inf))
    s = selection(candidates=ranked, choice=None, iterations=(), confidence=None, interrupted=True)
    for text in ("INTERRUPTED, NO MOTOR PASSES SO FAR", "The nearest is M3 at 12 V", "∞ *"):
        assert text in texts(s)


def test_errors_are_typed_and_leave_no_file(tmp_path):
    nowhere = tmp_path / "nowhere" / "motors.html"
    with refused(TraceFileError, about=(str(nowhere), os.strerror(errno.ENOENT))):
        write_selection_report(selection(demands={}, confidence=None), nowhere)
    with refused(ParameterError, "selection.candidates", 0):
        write_selection_report(selection(candidates=(), choice=None), tmp_path / "motors.html")
    assert list(tmp_path.iterdir()) == []


def test_the_ranking_is_printed_where_nothing_can_draw_a_report(run, monkeypatch):
    chosen = selection(demands={}, confidence=None)
    monkeypatch.setattr("hexapod_pin.study.selection.select_motors", lambda *_, **__: chosen)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = run("select", "kharagpur", "--quick")
    assert done.status == 0 and chosen.lines()[0] in done.out
    assert "no report: matplotlib is not installed" in done.err and done.left == []
    done = run("select", "kharagpur", "--quick", "--html", "motors.html")
    assert done.status == 2 and "matplotlib" in done.err


# notebooks ----------------------------------------------------------------------------------------


CELLS = {
    "robot": "import hexapod_pin as hp\nrobot = hp.load_robot('kharagpur')\nrobot",
    "scene": "scene = hp.Scene(robot, terrain=hp.Slope(angle=0.05))\nscene",
    "trace": "gait = hp.Gait.tripod(stroke=0.1, cycle_time=0.6)\n"
             "trace = hp.simulate(scene, hp.KinematicControl(gait), duration=2.6, accuracy=1e-3)\n"
             "trace",
    "budget": "hp.torque_budget(trace)",
    "torque": "trace.plot('torque')",
    "forces": "trace.plot.foot_forces(legs=['lf', 'rr'], between=(1.0, 2.0))",
    "com": "trace.plot.com()",
}  # fmt: skip


def plain(page: str) -> str:
    return html.unescape(re.sub("<[^>]*>", "", page))


@pytest.fixture(scope="module")
def shown() -> dict[str, dict[str, Any]]:
    shells = pytest.importorskip("IPython.core.interactiveshell").InteractiveShell
    shell = shells.instance()
    found = {}
    try:
        for name, cell in CELLS.items():
            done = shell.run_cell(cell)
            done.raise_error()
            found[name], _ = shell.display_formatter.format(done.result)
        found["objects"] = dict(shell.user_ns)
    finally:
        shells.clear_instance()
    return found


def test_a_notebook_shows_robot_scene_trace_and_figures(shown: dict) -> None:
    trace = shown["objects"]["trace"]
    for name, says in (
        ("robot", "rf_tibia"), ("scene", "kharagpur"), ("trace", f"{len(trace.time)} samples"),
    ):  # fmt: skip
        page = shown[name]["text/html"]
        assert says in plain(page) and "text/plain" in shown[name]
        ((_, frame),) = re.findall(r"""<iframe[^>]*srcdoc=(["'])(.*?)\1""", page, re.DOTALL)
        assert html.unescape(frame).startswith("<!DOCTYPE html>") and "MeshCat" in frame
        assert "http-equiv" in frame  # forbids itself the network
    for kind in hp.torque_budget(trace).kinds:
        for text in (kind.peak.joint, f"{kind.peak.torque_peak_time:.4g}"):
            assert text in plain(shown["budget"]["text/html"])
    for name in ("torque", "forces", "com"):
        assert shown[name]["image/png"][:4] in (b"\x89PNG", "iVBO")
    (axes,) = (one for one in trace.plot.torque(legs=["rr"]).axes if one.lines)
    (line,) = (one for one in axes.lines if one.get_label() == "femur")
    assert (line.get_ydata() == trace.torque[:, trace.joint("rr_femur_joint")]).all()
    assert (line.get_xdata() == trace.time).all() and axes.get_ylabel() == "torque [N m]"


def test_figures_refuse_what_they_cannot_draw(shown: dict) -> None:
    trace = shown["objects"]["trace"]
    with refused(UnknownNameError, about=("torques", "torque")):
        trace.plot("torques")
    with refused(NotRecordedError, "slip_speed"):
        trace.plot.slip()
    with refused(ParameterError, "between"):
        trace.plot.torque(between=(2.0, 1.0))


def test_a_selection_is_a_table_and_hostile_names_are_escaped() -> None:
    page = selection(robot_name="<i>six</i>", confidence=None)._repr_html_()
    assert "M1 at 12 V" in plain(page) and page.count("<table") >= 2
    assert "<i>" not in page


def test_what_cannot_be_drawn_says_why() -> None:
    page = with_run(synthetic_trace(duration=0.1), urdf=None)._repr_html_()
    assert "<iframe" not in page and "No playback" in page

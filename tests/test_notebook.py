"""What a notebook shows: its cells are run, and shown, as Jupyter's kernel does."""

from __future__ import annotations

import html
import re
from typing import Any

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import NotRecordedError, ParameterError, UnknownNameError
from tests.synthetic import synthetic_trace, with_run
from tests.test_selection_report import selection

pytest.importorskip("IPython")
pytest.importorskip("matplotlib")

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
    from IPython.core.interactiveshell import InteractiveShell

    shell = InteractiveShell.instance()
    found = {}
    try:
        for name, cell in CELLS.items():
            done = shell.run_cell(cell)
            done.raise_error()
            found[name], _ = shell.display_formatter.format(done.result)
        found["objects"] = dict(shell.user_ns)
    finally:
        InteractiveShell.clear_instance()
    return found


@pytest.mark.parametrize("name", ["robot", "scene", "trace"])
def test_a_notebook_shows_robot_scene_and_trace(shown: dict, name: str) -> None:
    page = shown[name]["text/html"]
    assert "kharagpur" in plain(page)
    ((_, frame),) = re.findall(r"""<iframe[^>]*srcdoc=(["'])(.*?)\1""", page, re.DOTALL)
    assert html.unescape(frame).startswith("<!DOCTYPE html>") and "MeshCat" in frame
    assert "http-equiv" in frame  # forbids itself the network
    assert "text/plain" in shown[name]


def test_the_numbers_shown_are_those_of_the_objects(shown: dict) -> None:
    trace = shown["objects"]["trace"]
    budget = hp.torque_budget(trace)
    for kind in budget.kinds:
        for text in (kind.peak.joint, f"{kind.peak.torque_peak_time:.4g}"):
            assert text in plain(shown["budget"]["text/html"])
    assert f"{len(trace.time)} samples" in plain(shown["trace"]["text/html"])
    assert "rf_tibia" in plain(shown["robot"]["text/html"])


def test_a_figure_is_shown_as_a_picture(shown: dict) -> None:
    for name in ("torque", "forces", "com"):
        assert shown[name]["image/png"][:4] in (b"\x89PNG", "iVBO")


def test_the_curves_are_the_samples(shown: dict) -> None:
    trace = shown["objects"]["trace"]
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

"""Reports of comparisons, sweeps and grids: header, numbers, figures, tables that are sorted."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import TraceFileError
from hexapod_pin.results.grid_columns import GridRecord
from hexapod_pin.results.peak_verdict import (
    FootImpulse,
    PeakVerdict,
    PeakVerdicts,
    Recomputation,
    Spread,
)
from hexapod_pin.results.result_files import Column
from hexapod_pin.results.schema import schema
from hexapod_pin.results.steady_window import Window
from hexapod_pin.results.walk_metrics import METRICS, ComparedRun, Outcome
from hexapod_pin.study.tuning_result import Candidate, Scores
from hexapod_pin.view import write_study_report
from tests.browser import browse

pytest.importorskip("matplotlib")


def comparison() -> hp.study.Comparison:
    """Return two controllers on one scene, of which one fell on another."""
    numbers = dict.fromkeys(METRICS)
    values = {"<i>a</i>": {"measured_speed": 1.0, "roll_rms": 1.0},
              "b": {"measured_speed": 5.0, "roll_rms": 1.5}}  # fmt: skip
    runs = [
        ComparedRun(
            "flat", 0, name, Outcome.WALKED, metrics=hp.study.WalkMetrics(**numbers | known)
        )
        for name, known in values.items()
    ]
    return hp.study.Comparison(
        tuple(runs), settings=("six legs, 4 s, ndf, accuracy 0.0001",), assumed=("rubber feet",),
        motor="kp 40 N m/rad", contact="restitution with stick-slip",
    )  # fmt: skip


@dataclass
class Sweep:
    """Three cases over one input, the last without numbers."""

    name: str = "loads"
    attributes: Mapping[str, str] = field(
        default_factory=lambda: {
            "robots": "six legs: S2",
            "assumed": "",
            "study_digest": "abc",
            "study": '[base]\nmotor = "AX-12A"\nvoltage = 11.1\ncontact = "s1"\n'
            'accuracy = 1e-4\ngait = {name = "tripod", stroke = 0.1}\n',
        }
    )

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """Return what is varied."""
        return [{"name": "payload", "unit": "kg", "meaning": "on the trunk", "grid": True}]

    @property
    def columns(self) -> dict[str, Column]:
        """Return the numbers of the cases."""
        peak = np.array([[1.0, 12.0], [2.0, 3.5], [np.nan, np.nan]])
        return {
            "kind": Column(("kind",), np.array(["coxa", "femur"], dtype=object), {}),
            "kind_torque_peak": Column(("case", "kind"), peak, {"units": "N m"}),
            "kind_torque_rms": Column(("case", "kind"), peak / 2.0, {"units": "N m"}),
            "reason": Column(("case",), np.array(["", "", "fell"], dtype=object), {}),
        }

    def input_values(self, name: str) -> np.ndarray:
        """Return the payloads."""
        return np.array([0.0, 0.5, 10.0])

    def __len__(self) -> int:
        """Return the number of cases."""
        return 3


SCENE = """[servo]
motor = {coxa = {stall_torque = 1.5, no_load_speed = 6.0}}
[contact]
normal = {kind = "restitution"}
friction = {kind = "stick_slip"}
"""


def grid(kind: type, **known: Any) -> Any:
    """Return a grid whose numbers are all 2, at points of 0.1 and 0.2."""
    sizes = {"stroke": 2, "cycle_time": 2, "joint": 3, "foot": 1, "phase": 2, "scene": 1,
             "gait": 2, "speed": 2, "motor": 3}  # fmt: skip
    axes = {"stroke", "cycle_time", "speed"}
    numbers = {
        name: np.array([0.1, 0.2]) if one.axes == (name,) and name in axes
        else np.full([sizes[axis] for axis in one.axes], 2.0) if one.axes else 2.0
        for name, one in schema(kind).items()
    }  # fmt: skip
    return kind(
        **numbers, run=GridRecord(robot="six legs", accuracy=1e-4, scene=SCENE), check=None, **known
    )


def torque_map() -> hp.study.TorqueMap:
    reason = np.array([["", ""], ["", "out of reach"]], dtype=object)
    return grid(
        hp.study.TorqueMap, joint_names=("a_coxa", "a_femur", "a_tibia"), foot_names=("a_foot",),
        joint_kinds=("coxa", "femur", "tibia"), reason=reason,
    )  # fmt: skip


def gait_energy() -> hp.study.GaitEnergy:
    reason = np.full((1, 2, 2), "", dtype=object)
    return grid(hp.study.GaitEnergy, scenes=("flat",), gaits=("tripod", "wave"), reason=reason)


def peaks() -> PeakVerdicts:
    """Return a peak that holds and one that a stiffer servo moves."""
    change = Recomputation("servo stiffness", "servo twice as stiff", "kp 40 to 80 N m/rad", "run")

    def row(name: str, high: float, verdict: str) -> PeakVerdict:
        spread = Spread(2.0, 1.9, high)
        moved = {"servo stiffness": high / 2.0 - 1.0}
        return PeakVerdict(name, "femur", verdict, spread, {"run": 2.0}, moved, (), 3.0, 0.0,
                           spread, spread, f"{name} is a {verdict}")  # fmt: skip

    rows = (row("lf_femur", 2.0, "peak"), row("rf_femur", 2.9, "range"))
    return PeakVerdicts(
        "six legs", Window(None, None, 1.0, 3.0, 2), (change,), rows, (row("femur", 2.9, "range"),),
        (FootImpulse("lf_foot", Spread(5.0, 4.9, 5.1)),), ("ndf, accuracy 0.0001",), (), (),
    )  # fmt: skip


def tuned() -> hp.study.TuningResult:
    """Return three candidates, of which one failed; better on the scene that was held out."""
    tried = (
        Candidate({"kp": 40.0}, 0.9, "", 0), Candidate({"kp": 99.0}, 1e3, "it fell", 1),
        Candidate({"kp": 55.0}, 0.5, "", 1),
    )  # fmt: skip
    on, held = (
        Scores(1.0, 0.9, best, {name: (1.0, 0.9, best)}, {})
        for name, best in (("flat", 0.5), ("hill", 0.75))
    )
    return hp.study.TuningResult(
        {"kp": 40.0},
        {"kp": 55.0},
        {"kp": (10.0, 100.0)},
        ("kp",),
        on,
        held,
        tried,
        1e3,
        3,
        robot="six legs",
        walk="tripod, stroke 0.1 m, cycle 1 s",
    )


@pytest.mark.parametrize(
    ("found", "figures", "texts"),
    [
        (comparison, 1, ["2 OF 2 RUNS WALKED", "six legs", "kp 40 N m/rad",
                         "restitution with stick-slip", "rubber feet", "5 (+400 %)"]),
        (Sweep, 1, ["2 OF 3 CASES HAVE NUMBERS", "payload", "12", "fell", "abc",
                    "AX-12A at 11.1 V", "tripod, stroke 0.1 m", "<dd>s1", "0.0001 m or rad"]),
        (torque_map, 2, ["3 OF 4 POINTS WERE WALKED", "out of reach",
                         "femur torque peak [N m]", "0.0001 m or rad",
                         "coxa: stall 1.5 N m", "restitution with stick_slip"]),
        (peaks, 1, ["1 OF 2 PEAKS HOLD", "six legs", "1.9 to 2.9", "+45.0", "kp 40 to 80 N m/rad",
                    "femur is a range", "ndf, accuracy 0.0001", "1 to 3 s, 2 whole cycle(s)"]),
        (tuned, 1, ["25.0 % BETTER ON SCENES THAT IT WAS NOT TUNED ON", "flat", "hill", "it fell",
                    "3 candidates, 1 failed", "logarithmic", "six legs", "cycle 1 s", "50.0 %"]),
        (gait_energy, 1, ["4 OF 4 POINTS WERE WALKED", "tripod, wave", "cost of transport [1]"]),
    ],
)  # fmt: skip
def test_a_report_has_header_figures_and_tables(
    tmp_path: Path, found: Any, figures: int, texts: list[str]
) -> None:
    command = "hexapod-pin compare 'a b.toml' c.toml"
    marks = {"date": "2020-02-02", "command": command}
    path = write_study_report(found(), tmp_path / "a.html", **marks)
    page = path.read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml") == figures and "<table" in page
    for text in (*texts, "2020-02-02", f"hexapod-pin {hp.__version__}"):
        assert text in page, text
    assert "hexapod-pin compare &#x27;a b.toml&#x27; c.toml" in page
    assert "<i>" not in page  # texts are escaped
    assert not re.search(r"@import|url\(|https?://(?!www\.w3\.org)", page)
    assert write_study_report(found(), tmp_path / "b.html", **marks).read_bytes() == (
        path.read_bytes()
    )
    with refused(TraceFileError, about=(".html",)):
        write_study_report(found(), tmp_path / "a.pdf")


def test_a_click_on_a_title_sorts_by_number_and_then_the_other_way(tmp_path: Path) -> None:
    """12 comes after 3.5, and what has no number is last either way."""
    page = write_study_report(Sweep(), tmp_path / "a.html").read_text(encoding="utf-8")
    script = """<script>
    const one = [...document.querySelectorAll("th")].find((th) => th.textContent === NAME);
    const seen = [1, 2].map(() => {
      one.click();
      const rows = [...one.closest("table").querySelectorAll("tr > td:first-child")];
      return [one.getAttribute("aria-sort"), ...rows.map((cell) => cell.textContent)].join(" ");
    });
    document.body.append(`SEEN ${seen.join("; ")} END`);
    </script></body>""".replace("NAME", "'femur peak [N m]'")
    clicked = tmp_path / "clicked.html"
    clicked.write_text(page.replace("</body>", script), "utf-8")
    shown = browse(clicked, "--dump-dom").decode()
    assert "SEEN ascending 1 0 2; descending 0 1 2 END" in shown

"""S2's study: its script leaves one file for claims, page and figures."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from studies.s2 import claims as s2_claims
from studies.s2 import motors as s2_motors
from studies.s2 import page as s2_page
from studies.s2 import runs as s2_runs
from studies.s2.claims import DONE, FAILS, HOLDS, IN_PART, Claim
from studies.s2.findings import contact_table, findings, output_table
from studies.s2.motors import Choices, chosen_motors
from studies.s2.runs import study_cases

import hexapod_pin as hp

pytestmark = pytest.mark.slow


def main(script: str) -> Callable[[list[str]], int]:
    return importlib.import_module(f"studies.s2.{script}").main


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file that the script leaves, with two values of each axis of the sweeps."""
    path = tmp_path_factory.mktemp("study") / "study.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(s2_runs, "SWEEP_ACCURACY", 1e-3)  # the verdicts are the same
        patch.setattr(s2_runs, "SLOW_ACCURACY", 1e-6)
        assert main("s2_study")(["--out", str(path), "--every", "11"]) == 0
    return path


@pytest.fixture(scope="module")
def study(path: Path) -> dict:
    return dict(s2_runs._loaded(path, path.stat().st_mtime_ns))


@pytest.fixture(scope="module")
def motors(study: dict) -> Iterator[Choices]:
    found = chosen_motors(study["paper"])
    with pytest.MonkeyPatch.context() as patch:
        for module in (s2_claims, s2_motors):
            patch.setattr(module, "chosen_motors", lambda _: found)
        yield found


@pytest.fixture(scope="module")
def tested(study: dict, motors: Choices) -> list[Claim]:
    return s2_claims.claims(study)


def test_one_file_holds_everything(study: dict) -> None:
    assert set(study) == {*study_cases(), "torque_map", "gait_energy"}
    assert study["paper"].time[-1] == pytest.approx(10.0)
    assert len(study["paper"].time[::5]) == 601  # S2's 600 output steps
    assert study["torque_map"].torque_peak.shape == (2, 2, 18)
    assert study["gait_energy"].scenes == tuple(s2_runs.energy_scenes(hp.load_robot("kharagpur")))


def test_statements_are_those_of_the_paper(study: dict, tested: list[Claim]) -> None:
    """Variations were checked, no trend was stated; assumptions (b) and (c) hold."""
    verdicts = {claim.text: claim.verdict for claim in tested}
    highest = "the torque of joint 1 is the highest in every leg"
    assert verdicts[f"{highest}: axis torque, what a motor gives"] == FAILS
    assert verdicts[f"{highest}: total moment across the joint"] == HOLDS
    assert verdicts["the walk is statically stable"] == HOLDS

    def verdict(begin: str) -> str:
        (one,) = (text for text in verdicts if text.startswith(begin))
        return verdicts[one]

    assert verdict("at most three complete cycles") == IN_PART  # above 2.5 s
    assert verdict("the variation of joint torques with the stroke") == DONE
    assert verdict("the variation of joint torques with the cycle time") == DONE
    assert not [text for text in verdicts if "grow" in text or "fall" in text]
    assert {claim.text.split(":")[0] for claim in findings(study)} >= {
        "torques grow with the stroke", "torques fall with the cycle time",
    }  # fmt: skip
    assert verdict("wave tetrapod gait") == HOLDS
    assert verdict("assumption (b)") == verdict("assumption (c)") == HOLDS
    assert verdict("(section 3.2) torques are proportional") == FAILS
    assert verdict("the maximum torque is what motors are chosen by") == FAILS
    assert verdict("(appendix) eq. 5") == IN_PART
    (impact,) = (claim.numbers for claim in tested if claim.text.startswith("(appendix)"))
    assert "+0.0758 N s on the feet, up" in impact and "-0.0758 N s with eq. 5" in impact
    assert all(claim.numbers and claim.reason for claim in tested)


def test_the_maximum_torque_chooses_a_motor_that_overheats(motors: Choices) -> None:
    """1.5 N m of stall torque exceed the 1.38 N m; a fifth of it, for ever, is below 0.75 N m."""
    found = motors
    assert found.axis_torque == pytest.approx(1.379, abs=5e-4)
    assert found.by_axis_torque.name == "AX-12A at 12 V"
    use = found.by_axis_torque.budget.kind("femur")
    assert use.continuous_use == pytest.approx(0.750 / 0.3, rel=2e-3) and not use.passes
    assert found.by_all_needs.budget.passes
    kinds = found.by_kind
    assert kinds["tibia"][1] == kinds["tibia"][2] and kinds["femur"][1] != kinds["femur"][2]


def test_output_steps_miss_the_sharp_peaks(study: dict) -> None:
    rows = output_table(study, s2_page.WALKS).rows
    first = [float(cell.split(", ")[1].split("%")[0]) for cell in rows[0][1:]]
    assert first == pytest.approx([14.4, 0.3, 0.1, 0.7], abs=0.15)
    missed = [float(x) for row in rows for c in row[1:] for x in
              c.split(", ")[1].replace("%", "").split(" to ")]  # fmt: skip
    assert min(missed) >= 0.0 and max(missed) > 40.0  # servos ring
    contacts = contact_table(study["gait_energy"]).rows
    assert [row[0] for row in contacts[:3]] == ["servo, s2", "servo, s1", "servo, accurate"]
    assert float(contacts[-1][1].split(" / ")[0]) > 2.0  # they move the size of the energy
    slow = s2_page.envelope_table(study).rows  # beside statics
    shares = [float(cell.split("(")[1].rstrip("%)")) for row in slow for cell in row[1:]]
    assert len(slow) == 4 and max(map(abs, shares)) <= 2.0


def test_page_is_written_from_the_file(
    study: dict, tested: list[Claim], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdicts = {"paper": hp.study.judge_peaks(study["paper"], threads=2)}
    monkeypatch.setattr(s2_page, "claims", lambda _: tested)
    text = s2_page.write_page(tmp_path, study, verdicts).read_text()
    assert "| 0.47 / 0.39 / 0.113 |" in text  # coxa of S2's motion: peak, p99, RMS
    assert "| 0.56 / 0.44 / 0.189 |" in text  # of the angle by one STEP
    assert "| peak 0.4664 N m | peak 1.379 N m | peak 0.1155 N m |" in text
    assert max(len(line) for line in text.splitlines() if not line.startswith("|")) < 140


SCRIPTS = {
    "s2_motion": ((), ["s2_motion.png"]),
    "s2_mass_center": (("--group", "constant"), ["s2_mass_center_constant.png"]),
    "s2_torques": ((), ["s2_quasi_static.png", "s2_torques.png"]),
    "s2_sweeps": ((), ["s2_torque_map.png", "s2_torque_peak.png", "s2_torque_rms.png"]),
    "s2_energy": ((), ["s2_energy.png"]),
}
"""Options of the scripts that draw from a study's file, and what they write."""


@pytest.mark.parametrize("script", list(SCRIPTS))
def test_scripts_draw_from_the_file(script: str, path: Path, tmp_path: Path) -> None:
    options, written = SCRIPTS[script]
    assert main(script)([str(path), str(tmp_path), *options]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == written
    assert all(10_000 < path.stat().st_size < 200_000 for path in tmp_path.iterdir())

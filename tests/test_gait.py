"""Gait tables, feet on the ground, refusals; stroke, lift and cycle fitted to a robot."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import fit_gait
from hexapod_pin.control.gait import GAITS, LEG_COUNTS, LEG_ORDER, Gait, gaits_for, smallest_duty
from hexapod_pin.control.stroke_posture import longest_stroke_posture
from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError
from hexapod_pin.robot.robot import leg_length

S2_ORDER = [LEG_ORDER.index(leg) for leg in ("lf", "rf", "lm", "rm", "lr", "rr")]
TABLES = [
    (Gait.tripod(), (0, 1 / 2, 1 / 2, 0, 0, 1 / 2), 3),
    (Gait.tetrapod(), (0, 2 / 3, 2 / 3, 1 / 3, 1 / 3, 0), 4),
    (Gait.wave(2 / 3), (0, 1 / 2, 2 / 3, 1 / 6, 1 / 3, 5 / 6), 4),
    (Gait.wave(3 / 4), (0, 1 / 2, 3 / 4, 1 / 4, 1 / 2, 0), 4),
    (Gait.wave(5 / 6), (0, 1 / 2, 5 / 6, 1 / 3, 2 / 3, 1 / 6), 5),
    (Gait.ripple(), (0, 1 / 2, 1 / 3, 5 / 6, 2 / 3, 1 / 6), 4),
]
"""Placements in S2's leg order 1..6, typed from the literature tables, relative to leg 1."""


@pytest.mark.parametrize(("gait", "table", "fewest"), TABLES)
def test_a_gait_is_its_published_table(gait: Gait, table: tuple[float, ...], fewest: int) -> None:
    """Placements; fewest feet down by closed form, literature and count; share on the ground."""
    ours = np.array(gait.phases)[S2_ORDER]
    apart = np.mod(ours - ours[0] - np.array(table) + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(apart, 0.0, atol=1e-15)  # thirds and sixths in binary
    down = gait.feet_down((np.arange(12_000) + 0.5) / 12_000)
    assert gait.minimum_feet_down == fewest == down.sum(axis=-1).min()
    np.testing.assert_allclose(down.mean(axis=0), gait.duty, atol=1.5 / 12_000)  # a sample each end


def test_speed_and_defaults_are_those_of_s2() -> None:
    """Speed is stroke over the time of the stance."""
    assert Gait.tetrapod().speed == pytest.approx(0.0875)  # S2: 0.14 / (2/3 * 2.4)
    assert Gait.wave(3 / 4, stroke=0.09, cycle_time=2.0).speed == pytest.approx(0.06)
    gait = Gait.tetrapod()
    assert (gait.stroke, gait.cycle_time, gait.lift, gait.duty) == (0.14, 2.4, 0.02, 2 / 3)


def test_the_page_of_walks_lists_the_gaits_of_each_number_of_legs() -> None:
    text = (Path(__file__).parents[1] / "docs" / "walking.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\d, ]+) \| (.*?) \| `\w+`", text, re.MULTILINE)
    found = {
        int(legs): tuple(re.findall(r"`(\w+)`", gaits))
        for counts, gaits in rows
        for legs in counts.split(", ")
    }
    assert found == {legs: gaits_for(legs) for legs in LEG_COUNTS}


def test_what_is_no_gait_is_refused() -> None:
    with refused(UnknownNameError, kind="gait", name="gallop", known=list(GAITS)):
        Gait.by_name("gallop")
    assert smallest_duty(Gait.tripod().phases) == 0.5
    with refused(GaitError, quantity="duty", limit=0.5, about=("0.45",)):
        Gait.wave(0.45)
    phases = (0, 0, 0.3, 0.3, 0.7, 0.7)
    limit = smallest_duty(phases)
    assert Gait.custom(phases, limit).minimum_feet_down >= 3
    with refused(GaitError, quantity="duty", limit=limit):
        Gait.custom(phases, limit - 1e-6)


def test_a_bad_parameter_is_named() -> None:
    for make, name, value in (
        (lambda: Gait.tripod(stroke=-0.1), "Gait.stroke", -0.1),
        (lambda: Gait.tripod(cycle_time=np.inf), "Gait.cycle_time", np.inf),
        (lambda: Gait.wave(1.0), "Gait.duty", 1.0),
        (lambda: Gait.wave(np.nan), "Gait.wave.duty", np.nan),
        (lambda: Gait.custom((0, 0, 0, 0, 0, 1.0), 0.7), "Gait.phases[5]", 1.0),
        (lambda: Gait.custom((0, 0.5), 0.7), "Gait.phases", (0.0, 0.5)),
    ):
        with refused(ParameterError, name, value):
            make()


@pytest.mark.parametrize("factor", [0.4, 3.0])
def test_default_gaits_are_similar_whatever_the_size_of_the_robot(
    tmp_path: Path, factor: float
) -> None:
    """The Froude number is that of S2's gait with legs of 0.30 or 0.38 m, to rounding (1 %)."""
    robot = hp.load_robot(scaled_robot(tmp_path, factor))
    length, reference = leg_length(robot), 0.30 if factor < 1.0 else 0.38
    fitted = fit_gait(robot, "tetrapod", cycle_time=None)
    gait, scale = fitted.gait, length / reference
    assert fitted.scale == pytest.approx(scale, rel=1e-6)
    assert gait.stroke == pytest.approx(0.14 * scale, rel=5e-3)  # three digits
    assert gait.lift == pytest.approx(0.02 * scale, rel=5e-3)
    assert gait.cycle_time == pytest.approx(2.4 * math.sqrt(scale), rel=5e-3)
    assert fitted.froude == pytest.approx(0.0875**2 / (9.81 * reference), rel=0.02)
    assert fitted.stroke == fitted.lift == fitted.cycle_time == "scaled to its legs"
    assert len(fitted.remarks) == 1 and "S2's gait scaled to its legs" in fitted.remarks[0]
    assert fit_gait(robot, "tripod", lift=0.02).lift == "as given"


def scaled_robot(folder: Path, factor: float) -> Path:
    """Return the file of kharagpur with all lengths times a factor, and its joints as fast."""

    def longer(found: re.Match[str]) -> str:
        numbers = " ".join(f"{factor * float(text):.9g}" for text in found[2].split())
        return f'{found[1]}="{numbers}"'

    text = hp.urdf_path("kharagpur").read_text()
    path = folder / "scaled.urdf"
    path.write_text(re.sub(r'\b(xyz|size|radius|length)="([^"]*)"', longer, text))
    return path


def test_a_speed_sets_the_cycle_or_the_stroke() -> None:
    """What is not given is kept where it can be, but for athena's wave: 3.47 of 3.14 rad/s."""
    assert fit_gait(hp.load_robot("athena"), "wave").gait.cycle_time == pytest.approx(3.4)
    robot = hp.load_robot("kharagpur")
    fitted = fit_gait(robot, "wave")
    assert (fitted.gait.stroke, fitted.gait.lift, fitted.gait.cycle_time) == (0.14, 0.02, 2.4)
    assert fitted.stroke == fitted.lift == fitted.cycle_time == "default"
    slow = fit_gait(robot, "tetrapod", speed=0.05).gait
    assert (slow.stroke, slow.speed) == pytest.approx((0.14, 0.05))
    short = fit_gait(robot, "tetrapod", speed=0.05, cycle_time=2.0).gait
    assert (short.cycle_time, short.speed) == pytest.approx((2.0, 0.05))
    with refused(GaitError, quantity="speed") as caught:
        fit_gait(robot, "tetrapod", speed=2.0)
    assert 0.1 < caught.value.limit < 2.0
    assert fit_gait(robot, "tetrapod", speed=0.99 * caught.value.limit)
    with refused(ParameterError, "speed"):
        fit_gait(robot, "tetrapod", 0.1, cycle_time=2.0, speed=0.1)


def test_a_short_stroke_names_what_limits_it_and_a_posture_leaves_more(tmp_path: Path) -> None:
    """Coxae of +-0.25 rad end the stroke; with the feet further out the same turn goes further."""
    text = hp.urdf_path("kharagpur").read_text()
    part = r'(<joint name="\w+_coxa_joint".*?<limit[^>]*?)lower="[^"]*"([^>]*?)upper="[^"]*"'
    narrow = re.sub(part, r'\1lower="-0.25"\2upper="0.25"', text, flags=re.S)
    (tmp_path / "narrow.urdf").write_text(narrow)
    robot = hp.load_robot(tmp_path / "narrow.urdf")
    fitted = fit_gait(robot, "tetrapod")
    assert fitted.gait.stroke < 0.75 * fitted.wanted == 0.75 * 0.14
    assert "coxa_joint is at its limit" in fitted.limit
    assert fitted.shortage == (f"stroke {1e3 * fitted.gait.stroke:.3g} of 140 mm ({fitted.limit})")
    found = longest_stroke_posture(robot, fitted.gait.with_changes(stroke=0.14))
    assert found.helps and found.stroke > fitted.gait.stroke / 0.8
    better = hp.load_robot(robot.source, posture=found.posture)
    walked = fitted.gait.with_changes(stroke=found.stroke, cycle_time=10.0)
    assert hp.KinematicControl(walked).plan(better, 10.0) is not None  # nothing refuses it

"""The lines that a user decides by: what stands first, its doubts, and the motors that carry it."""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import Run

import hexapod_pin as hp
from hexapod_pin.ground.terrain import Ramp
from hexapod_pin.results.ground_obstacle import find_obstacle
from hexapod_pin.results.sizing import joint_demand, motor_budget
from hexapod_pin.results.sizing.ranking import lightest_motors
from hexapod_pin.results.walk_answer import _failed, rounded, walk_answer
from hexapod_pin.results.walk_verdict import cautions
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.text_table import WIDTH

WALK = tuple("--gait tripod --cycle-time 0.8 --stroke 0.05 --no-html".split())


def joined(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=0.8))
    return hp.simulate(hp.Scene(hp.load_robot("kharagpur")), control, duration=2.4)


def scaled(folder: Path, factor: float, pattern: str, link: str = "") -> Path:
    """Write kharagpur with the numbers of an attribute times a factor, of all links or of one."""

    def larger(found: re.Match[str]) -> str:
        return f'{found[1]}="{factor * float(found[2])!r}"'

    parts = re.split(r"(?=<link )", hp.load_robot("kharagpur").urdf)
    path = folder / "scaled.urdf"
    start, number = f'<link name="{link}', re.compile(rf'({pattern})="([^"]+)"')
    path.write_text("".join(number.sub(larger, p) if p.startswith(start) else p for p in parts))
    return path


INERTIA, MASS = "i[xyz]{2}", "<mass value"


def test_eight_lines_with_the_verdict_first(run: Run) -> None:
    done = run("walk", "kharagpur", *WALK)
    lines = done.out.splitlines()
    assert done.status == 0 and len(lines) == 8
    assert max(map(len, lines)) <= WIDTH
    assert re.match(
        r"kharagpur walks 0\.12\d m/s \(\d+\.\d%\), slip \S+ %, margin \d+ mm", done.out
    )
    assert [line.split()[0] for line in lines[3:6]] == ["coxa", "femur", "tibia"]
    assert lines[7] == "wrote walk.nc   next: hexapod-pin budget walk.nc --catalog"
    budget = run("budget", "walk.nc").out.splitlines()
    assert budget[:6] == lines[:6]
    catalogue = run("budget", "walk.nc", "--catalog")
    assert catalogue.status == 0 and " motors pass all joints" in catalogue.out


def test_a_motor_without_mass_of_many_times_the_need_is_doubted() -> None:
    """10 kgf cm read as 10 N m: no rule refuses it; a gear that was forgotten was not named."""
    robot = hp.load_robot("kharagpur")
    found = {}
    motors = ((3.0, 6.0, 0.0), (10.0, 6.0, 0.0), (2.0, 600.0, 0.0), (4.0, 6.0, 2e-7))
    for stall, speed, rotor in motors:
        motor = hp.Motor(stall_torque=stall, no_load_speed=speed, rotor_inertia=rotor)
        servo = hp.Servo.for_robot(robot).model_copy(update={"motor": motor})
        gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.6))
        run = hp.simulate(hp.Scene(robot, servo=servo), gait, duration=1.3, accuracy=1e-3)
        found[stall] = cautions(run, None)
    assert found[3.0] == ()
    assert re.match(r"motors of 10 N m, \S+ needed \(kgf cm\?\)", found[10.0][0])
    assert found[2.0] == ("motors of 600 rad/s (before the gear? rpm?)",)
    assert found[4.0] == ("rotors of 2e-07 kg m^2 at gear ratio 1 (forgotten?)",)


def test_inertias_in_another_unit_are_in_the_first_line(run: Run, tmp_path: Path) -> None:
    """Torques three times too large were said to be those of a robot that walks."""
    path = scaled(tmp_path, 1000.0, INERTIA)
    done = run("walk", path.name, *WALK, "--accuracy", "1e-3")
    first = done.out.splitlines()[0]
    assert done.status == 3
    assert "NOT to be trusted" in first and "inertias look like g m^2" in first
    assert "--repair" in done.out
    saved = ("--save-case", "c.toml", "--out", "sound.nc")
    sound = run("walk", "kharagpur", *WALK, "--quick", "--json", *saved)
    data = json.loads(sound.out)  # it stands alone: the path of the case goes to stderr
    assert sound.status == 0 and "c.toml" in sound.err and data["good"]
    assert [Path(name).name for name in data["files"]] == ["sound.nc"]
    peaks = {k["kind"]: k["peak"]["torque_peak"] for k in data["budget"]["kinds"]}
    tried = joined(done.out).split("tried with --repair, peaks are: ")[1]
    for kind, peak in peaks.items():
        found = float(re.search(rf"{kind} ([\d.]+)", tried)[1])  # type: ignore[index]
        assert found == pytest.approx(peak, rel=0.02)  # factors of ten are written with few digits
    assert run("budget", "walk.nc").status == 3


def test_a_doubt_that_changes_no_torque_is_not_in_the_first_line(run: Run, tmp_path: Path) -> None:
    path = scaled(tmp_path, 70.0, INERTIA, "lf_coxa")
    robot = hp.load_robot(path)
    assert len(robot.doubts) == 1 and "fit the size: link" in robot.doubts[0]
    done = run("walk", path.name, *WALK, "--accuracy", "1e-3")
    assert done.status == 0 and " walks " in done.out.splitlines()[0]
    assert "no torque changes by more than" in joined(done.out)


def test_a_mass_that_no_such_robot_has_is_a_doubt(run: Run, tmp_path: Path) -> None:
    """Of 3.09 kg on legs of 0.30 m: 0.13 kg had no note, 84.5 kg were kept by the repair."""
    for factor in (0.04, 4.4):
        path = scaled(tmp_path, factor, MASS)
        robot = hp.load_robot(path)
        assert robot.doubts[0].startswith(f"mass {robot.total_mass:.3g} kg, 0.549 kg to 8.68 kg is")
        stated = LoadOptions(repair=True, mass=robot.total_mass)
        assert hp.load_robot(path, options=stated).doubts == ()
    repaired = hp.load_robot(scaled(tmp_path, 84.5 / 3.087, MASS), repair=True)
    assert repaired.total_mass == pytest.approx(3.0, abs=0.1) and repaired.doubts == ()
    assert any("all masses and inertias multiplied by" in text for text in repaired.repaired)
    # the repair keeps 3.5 times: that nothing changes by it does not make it sure
    done = run("walk", scaled(tmp_path, 3.5, MASS).name, *WALK, "--quick")
    assert done.status == 3 and "NOT to be trusted: mass 10.8 kg" in done.out.splitlines()[0]
    assert "--repair --mass KG" in done.out


def test_one_verdict_on_a_motor(run: Run, trace: hp.Trace) -> None:
    """`walk --motor` said that no joint was at its limit; `budget --motor` that it fails."""
    walked = run("walk", "kharagpur", *WALK, "--quick", "--motor", "AX-12A")
    first = walked.out.splitlines()[0]
    assert walked.status == 3 and "but AX-12A at 12 V FAILS (femur" in first
    judged = run("budget", "walk.nc", "--motor", "AX-12A")
    assert judged.out.splitlines()[0] == first and judged.status == 3
    strong = walk_answer(trace, hp.load_catalog().get("MX-64", 12.0))
    assert strong.good and "MX-64 at 12 V passes" in "\n".join(strong.lines())
    demand, rows = joint_demand(trace), [row for row in hp.load_catalog() if row.voltage == 12.0]
    usable = [row for row in rows if row.mass and row.stall_torque and row.no_load_speed]
    for kind, motor in lightest_motors(demand, rows).items():
        passing = [row.mass for row in usable if motor_budget(demand, row).kind(kind).passes]
        assert motor is not None and motor.mass == min(passing)
    found = [rounded(value, error) for value, error in ((1.1163, 0.2), (1.1163, 3.0), (0.05983, 0))]
    assert found == ["1.1", "1", "0.0598"]  # no digit below the error


# Advice: the cause in the first line, and what to change tried by a run.


def test_a_stair_higher_than_the_lift(run: Run) -> None:
    """The advice was a larger friction coefficient; the cure named now was tried."""
    options = "--terrain stairs:0.03 --no-html --accuracy 1e-2 --duration 8"
    done = run("walk", "kharagpur", *options.split())
    said = joined(done.out)
    cause = r"kharagpur does not walk: the ground is (29|30) mm high, its lift 20 mm"
    assert done.status == 3 and re.fullmatch(cause, done.out.splitlines()[0])
    assert "lift them by 40 mm (--lift 0.04)" in said
    assert re.search(r"tried with --lift 0.04: it walks, 0\.\d+ of 0\.\d+ m", said)
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=hp.Slope(angle=0.2))
    gait = hp.Gait.tripod(stroke=0.1, cycle_time=1.0)
    climb = hp.simulate(scene, hp.KinematicControl(gait), duration=1.0, step=2e-3)
    assert find_obstacle(climb).height == pytest.approx(0.0, abs=1e-12)  # a slope has none


def test_a_slope_too_steep_for_friction(run: Run) -> None:
    options = "--terrain slope:40 --duration 4 --quick --gait tripod --cycle-time 1"
    done = run("walk", "kharagpur", *options.split(), "--no-html")
    first = done.out.splitlines()[0]
    assert done.status == 3 and "40 degrees are too steep for friction of 0.7" in first
    assert re.search(r"it slides back at [\d.]+ m/s; the ground", joined(done.out))


def test_ground_and_loads_that_are_none(run: Run) -> None:
    for option, said in (
        ("--terrain stairs:x", "a number instead of 'x'"),
        ("--terrain stair:0.02", "with its numbers. Did you mean 'stairs'?"),
        ("--terrain bumps:0.02:a", "the seed an integer"),
        ("--push 20N", "FORCE@TIME"),
        ("--payload 1kg@nolink", "nolink"),
    ):
        done = run("walk", "kharagpur", *WALK, "--duration", "0.1", *option.split())
        assert done.status == 2 and said in done.err and done.left == []


def test_ground_and_loads_reach_the_case(run: Run, tmp_path: Path) -> None:
    (tmp_path / "ground.toml").write_text('kind = "ramp"\nangle = 0.1\nstart = 0.5\nrun = 0.4\n')
    options = "--terrain ground.toml --payload 1.5kg@lf_tibia --push -20N@0.05s --lost-leg rm@0.05s"
    done = run("walk", "kharagpur", *WALK, *"--duration 0.1 --save-case c.toml".split(),
               *options.split())  # fmt: skip
    assert done.status == 0, done.err
    scene = hp.load_case("c.toml").scene
    assert scene.terrain == Ramp(angle=0.1, start=0.5, run=0.4)
    assert scene.loads == (
        hp.loads.Payload("lf_tibia", 1.5),
        hp.loads.Push("base_link", force=(0.0, -20.0, 0.0), start=0.05, duration=0.1),
        hp.loads.LostLeg("rm", 0.05),
    )


def test_a_refused_file_is_grouped_and_ends_with_the_next_command(run: Run, tmp_path: Path) -> None:
    """The refusal of a real file was one line of 4677 characters, without the repair."""
    text = hp.load_robot("kharagpur").urdf
    (tmp_path / "slow.urdf").write_text(re.sub(r'velocity="[^"]+"', 'velocity="0"', text))
    done = run("walk", "slow.urdf", *WALK)
    lines = done.err.splitlines()
    assert done.status == 2 and max(map(len, lines)) <= WIDTH and len(lines) <= 6
    assert "18 joints: 'lf_coxa_joint', " in done.err and "zero velocity" in joined(done.err)
    assert lines[-1] == "next: hexapod-pin walk slow.urdf --repair"
    cut = text.replace('<parent link="base_link"', '<parent link="none"')
    (tmp_path / "cut.urdf").write_text(cut)
    refused = run("walk", "cut.urdf", *WALK)
    assert refused.status == 2 and refused.err.splitlines()[-1].endswith("check cut.urdf")


def test_no_line_of_any_command_wraps(
    run: Run, trace: hp.Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tables and sentences of up to 370 characters were printed as they were."""
    trace.save("walk.nc")
    scaled(tmp_path, 1000.0, INERTIA)
    commands = [
        "budget walk.nc --joints", "budget walk.nc --assumed", "budget walk.nc --catalog --full",
        "budget walk.nc --motor AX-12A", "stability walk.nc", "check scaled.urdf",
        "repair scaled.urdf -o new.urdf", "contact accurate", "walk scaled.urdf --mu x",
        "walk kharagpur --gait tripod --cycle-time 0.1", "run none.toml", "view none.nc", "",
    ]  # fmt: skip
    for words in commands:
        width = 120 if "scaled" in words else 80
        monkeypatch.setenv("COLUMNS", str(width))
        done = run(*words.split())
        lines = (done.out + done.err).replace(f"{tmp_path}/", "").splitlines()
        assert lines and max(map(len, lines)) <= width, (words, max(lines, key=len))


def test_a_centre_of_mass_is_outside_its_feet_where_that_lasts(monkeypatch) -> None:
    """What is over within 20 ms, ten samples, does not count; the least inside does."""
    time, found = 0.002 * np.arange(501), []
    for until in (100, 110, 111):
        margins = np.full(len(time), 0.05)
        margins[100:until], margins[200] = -0.4, 0.03
        steady = SimpleNamespace(static_margin=margins, time=time)
        monkeypatch.setattr(sys.modules[walk_answer.__module__], "stability", lambda _, s=steady: s)
        found.append(sys.modules[walk_answer.__module__]._margin(None))
    assert found == [0.03, 0.05, -0.4]


def test_a_motor_that_is_to_drive_faster_than_it_turns_has_no_number_for_its_peak() -> None:
    """It read "femur peak inf"."""
    found = SimpleNamespace(failures=("peak_use", "speed_use"), peak_use=math.inf, speed_use=1.07)
    assert _failed(found) == ["beyond the no-load speed", "speed 1.07"]  # type: ignore[arg-type]

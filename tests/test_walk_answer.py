"""The lines that a user decides by: what stands first, its doubts, and the motors that carry it."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import Run
from test_gait import narrow_coxae

import hexapod_pin as hp
from hexapod_pin.commands import terminal
from hexapod_pin.commands.case_report import following_command
from hexapod_pin.commands.scene_options import heading_doubt, slope_doubt, turn_doubt
from hexapod_pin.ground.terrain import Ramp
from hexapod_pin.results.ground_obstacle import SPACING, Obstacle, find_obstacle
from hexapod_pin.results.sizing import joint_demand, motor_budget
from hexapod_pin.results.sizing.ranking import lightest_motors
from hexapod_pin.results.walk_answer import rounded, walk_answer
from hexapod_pin.results.walk_causes import dragging
from hexapod_pin.results.walk_verdict import cautions
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.text_table import WIDTH

WALK = (*"--gait tripod --cycle-time 0.8 --stroke 0.05 --no-html".split(),)


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    """A walk of one steady cycle and more."""
    gait = hp.Gait.tripod(stroke=0.05, cycle_time=0.8)
    return hp.simulate(
        hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(gait), duration=2.4
    )


def scaled_inertias(folder: Path, factor: float, link: str = "") -> Path:
    """Write kharagpur with the inertias of all links, or of one, times a factor."""
    text = hp.load_robot("kharagpur").urdf
    number = re.compile(r'(i[xyz]{2})="([^"]+)"')

    def larger(inertia: re.Match[str]) -> str:
        return number.sub(lambda m: f'{m[1]}="{factor * float(m[2])!r}"', inertia[0])

    parts = re.split(r"(?=<link )", text)
    changed = [
        re.sub(r"<inertia [^>]*>", larger, part)
        if part.startswith(f'<link name="{link}' if link else "<link ")
        else part
        for part in parts
    ]
    path = folder / "scaled.urdf"
    path.write_text("".join(changed))
    return path


def test_eight_lines_with_the_verdict_first(run: Run) -> None:
    done = run("walk", "kharagpur", *WALK)
    lines = done.out.splitlines()
    assert done.status == 0 and len(lines) == 8
    assert max(map(len, lines)) <= WIDTH
    assert re.match(
        r"kharagpur walks 0\.12\d m/s \(\d+\.\d%\), slip \S+ %, margin \d+ mm", lines[0]
    )
    assert [line.split()[0] for line in lines[3:6]] == ["coxa", "femur", "tibia"]
    assert "assumed (--assumed)" in lines[6]
    assert lines[7] == "wrote walk.nc   next: hexapod-pin budget walk.nc --catalog"
    budget = run("budget", "walk.nc").out.splitlines()
    assert budget[:6] == lines[:6]
    catalogue = run("budget", "walk.nc", "--catalog")
    assert catalogue.status == 0 and " motors pass all joints" in catalogue.out
    assert len(catalogue.out.splitlines()) <= 18
    assert "Why not" in run("budget", "walk.nc", "--catalog", "--full").out


def test_degrees_that_look_like_radians_are_doubted() -> None:
    """Python takes radians, the command line degrees."""
    assert heading_doubt(1.57) == "heading 1.57 degrees (90 if radians are meant)"
    assert "-45 if" in heading_doubt(-0.785) and "28.6 if" in heading_doubt(0.5)
    assert [heading_doubt(x) for x in (0.0, 5.0, 30.0, 90.0, 1.2)] == [""] * 5
    assert "(17.2 if" in turn_doubt(0.3) and turn_doubt(10.0) == turn_doubt(0.0) == ""
    assert "slope 0.17 degrees (9.74" in slope_doubt("slope:0.17")
    assert [slope_doubt(x) for x in (None, "slope:10", "stairs:0.03")] == [""] * 3


def test_feet_that_are_dragged_are_no_walk_but_of_legs_without_torque() -> None:
    slip = {"lf_foot": 0.02, "rf_foot": 1.02, "rm_foot": 0.98}
    assert dragging(slip, 0) == dragging(slip, 1) == "it drags rf_foot and rm_foot along"
    assert dragging(slip, 2) == dragging(None, 0) == dragging({"lf_foot": 0.3}, 0) == ""


def test_a_motor_without_mass_of_many_times_the_need_is_doubted() -> None:
    """10 kgf cm read as 10 N m: no rule refuses it, for a large motor has as much.

    A gear that was forgotten was not named either.
    """
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
    path = scaled_inertias(tmp_path, 1000.0)
    done = run("walk", path.name, *WALK, "--accuracy", "1e-3")
    first = done.out.splitlines()[0]
    assert done.status == 3
    assert "NOT to be trusted" in first and "inertias look like g m^2" in first
    assert "--repair" in done.out
    sound = run("walk", "kharagpur", *WALK, "--quick", "--json", "--save-case", "c.toml",
                "--out", "sound.nc")  # fmt: skip
    data = json.loads(sound.out)  # it stands alone: the path of the case goes to stderr
    assert sound.status == 0 and "c.toml" in sound.err
    assert data["good"] and data["answer"][0].startswith("kharagpur walks")
    assert [Path(name).name for name in data["files"]] == ["sound.nc"]
    peaks = {k["kind"]: k["peak"]["torque_peak"] for k in data["budget"]["kinds"]}
    tried = " ".join(done.out.split()).split("tried with --repair, peaks are: ")[1]
    for kind, peak in peaks.items():
        found = float(re.search(rf"{kind} ([\d.]+)", tried)[1])  # type: ignore[index]
        assert found == pytest.approx(peak, rel=0.02)  # factors of ten are written with few digits
    assert run("budget", "walk.nc").status == 3


def test_a_doubt_that_changes_no_torque_is_not_in_the_first_line(run: Run, tmp_path: Path) -> None:
    """One coxa with 70 times its inertia: tried with the repaired file, nothing changes."""
    path = scaled_inertias(tmp_path, 70.0, "lf_coxa")
    robot = hp.load_robot(path)
    assert len(robot.doubts) == 1 and "fit the size: link" in robot.doubts[0]
    done = run("walk", path.name, *WALK, "--accuracy", "1e-3")
    assert done.status == 0 and " walks " in done.out.splitlines()[0]
    assert "no torque changes by more than" in " ".join(done.out.split())


def scaled_masses(folder: Path, factor: float) -> Path:
    """Write kharagpur, 3.09 kg on legs of 0.30 m, with all masses times a factor."""
    text = hp.load_robot("kharagpur").urdf
    path = folder / "mass.urdf"
    number = re.compile(r'<mass value="([^"]+)"')
    path.write_text(number.sub(lambda m: f'<mass value="{factor * float(m[1])!r}"', text))
    return path


@pytest.mark.parametrize(("factor", "doubted"), [(0.04, True), (1.0, False), (4.4, True)])
def test_a_mass_that_no_such_robot_has_is_a_doubt(
    tmp_path: Path, factor: float, doubted: bool
) -> None:
    """9.76 kg for a robot of 2.2 kg, and 0.13 kg, had no note; a stated mass has none."""
    path = scaled_masses(tmp_path, factor)
    robot = hp.load_robot(path)
    assert bool(robot.doubts) is doubted
    if doubted:
        assert robot.doubts[0].startswith(f"mass {robot.total_mass:.3g} kg, 0.549 kg to 8.68 kg is")
        stated = LoadOptions(repair=True, mass=robot.total_mass)
        assert hp.load_robot(path, options=stated).doubts == ()


def test_the_repair_does_not_keep_a_mass_far_beyond_any(tmp_path: Path) -> None:
    """84.5 kg were kept; the usual mass of robots with such legs is that of the packaged robot."""
    path = scaled_masses(tmp_path, 84.5 / 3.087)
    repaired = hp.load_robot(path, repair=True)
    assert repaired.total_mass == pytest.approx(3.0, abs=0.1) and repaired.doubts == ()
    assert any("all masses and inertias multiplied by" in text for text in repaired.repaired)


def test_a_doubtful_mass_is_in_the_first_line_whatever_the_repair(run: Run, tmp_path: Path) -> None:
    """The repair keeps it: that nothing changes by it does not make it sure."""
    done = run("walk", scaled_masses(tmp_path, 3.5).name, *WALK, "--quick")
    assert done.status == 3 and "NOT to be trusted: mass 10.8 kg" in done.out.splitlines()[0]
    assert "--repair --mass KG" in done.out


def test_one_verdict_on_a_motor(run: Run, trace: hp.Trace) -> None:
    """`walk --motor` said that no joint was at its limit; `budget --motor` that it fails."""
    walked = run("walk", "kharagpur", *WALK, "--quick", "--motor", "AX-12A")
    first = walked.out.splitlines()[0]
    assert walked.status == 3 and "but AX-12A at 12 V FAILS (femur" in first
    judged = run("budget", "walk.nc", "--motor", "AX-12A")
    assert judged.out.splitlines()[0] == first and judged.status == 3
    record = hp.load_catalog().get("AX-12A")
    answer = walk_answer(trace, record)
    assert not answer.good and answer.motor is not None
    assert answer.motor.reasons == motor_budget(joint_demand(trace), record).reasons
    strong = walk_answer(trace, hp.load_catalog().get("MX-64", 12.0))
    assert strong.good and "MX-64 at 12 V passes" in "\n".join(strong.lines())


def test_lightest_motors_are_the_first_that_pass(trace: hp.Trace) -> None:
    """By kind of joint, none lighter passes; the use is that of the motor's own budget."""
    demand, rows = joint_demand(trace), [r for r in hp.load_catalog() if r.voltage == 12.0]
    usable = [row for row in rows if row.mass and row.stall_torque and row.no_load_speed]
    found = lightest_motors(demand, rows)
    assert set(found) == {"coxa", "femur", "tibia"}
    for kind, motor in found.items():
        assert motor is not None
        uses = {row.name: motor_budget(demand, row).kind(kind) for row in usable}
        passing = [row.mass for row in usable if uses[row.name].passes]
        assert motor.mass == min(mass for mass in passing if mass is not None)
        assert motor.use == uses[motor.motor].deciding_use <= 1.0
    assert lightest_motors(demand, []) == dict.fromkeys(found)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.4612, 0.002, "0.461"), (1.1163, 0.01, "1.12"), (1.1163, 0.04, "1.12"),
        (1.1163, 0.2, "1.1"), (0.05983, None, "0.0598"), (123.456, None, "123"), (0.0, 1e-9, "0"),
        (2.0, 0.0, "2.00"), (1.1163, 3.0, "1"),
    ],
)  # fmt: skip
def test_numbers_have_no_digit_below_their_error(
    value: float, error: float | None, text: str
) -> None:
    assert rounded(value, error) == text


def test_a_run_without_a_cycle_is_no_verdict(run: Run) -> None:
    done = run("walk", "kharagpur", *WALK, "--duration", "0.5")
    lines = done.out.splitlines()
    assert done.status == 0 and lines[0].startswith("so far: kharagpur")
    assert "simulate 2.4 s or more (--duration 2.4)" in " ".join(lines[1:3])


# Advice: the cause in the first line, and what to change tried by a run.


def test_a_stair_higher_than_the_lift(run: Run) -> None:
    """The advice was a larger friction coefficient; the cure named now was tried."""
    options = "--terrain stairs:0.03 --no-html --accuracy 1e-2 --duration 8"
    done = run("walk", "kharagpur", *options.split())
    said = " ".join(done.out.split())
    assert done.status == 3
    assert re.fullmatch(
        r"kharagpur does not walk: the ground is (29|30) mm high, its lift 20 mm",
        done.out.splitlines()[0],
    )
    assert "lift them by 40 mm (--lift 0.04)" in said
    assert re.search(r"tried with --lift 0.04: it walks, 0\.\d+ of 0\.\d+ m", said)


def test_a_short_stroke_is_in_the_first_line_with_its_cause_and_a_cure(
    run: Run, tmp_path: Path
) -> None:
    """Strokes of a fifth of the usual one walked "99.8 % of nominal" without a word."""
    narrow_coxae(tmp_path)
    done = run("walk", "narrow.urdf", "--no-html", "--duration", "0.2")
    said = " ".join(done.out.split())
    assert re.search(r"stroke [\d.]+ of 140 mm \(\w+_coxa_joint is at its limit", said[:160])
    assert re.search(r"tried --posture longest-stroke: it leaves a stroke of [\d.]+ of 140", said)


def test_a_slope_too_steep_for_friction(run: Run) -> None:
    """40 degrees with a friction coefficient of 0.7, which holds up to 35."""
    options = "--terrain slope:40 --duration 4 --quick --gait tripod --cycle-time 1"
    done = run("walk", "kharagpur", *options.split(), "--no-html")
    first = done.out.splitlines()[0]
    assert done.status == 3 and "40 degrees are too steep for friction of 0.7" in first
    assert re.search(r"it slides back at [\d.]+ m/s; the ground", " ".join(done.out.split()))
    assert "-" not in done.out.splitlines()[1] and "% of the nominal" not in done.out


def test_obstacles_stand_above_the_line_between_footholds() -> None:
    """A slope has none; a riser its height less that of the line; closed forms."""
    robot = hp.load_robot("kharagpur")
    gait = hp.Gait.tripod(stroke=0.1, cycle_time=1.0, lift=0.03)

    def found(terrain: hp.Flat | hp.Slope | hp.Stairs) -> Obstacle:
        scene = hp.Scene(robot, terrain=terrain)
        trace = hp.simulate(scene, hp.KinematicControl(gait), duration=1.0, step=1e-3)
        obstacle = find_obstacle(trace)
        assert obstacle is not None
        return obstacle

    assert found(hp.Flat()).height == 0.0
    assert found(hp.Slope(angle=0.2)).height == pytest.approx(0.0, abs=1e-12)
    riser = found(hp.Stairs(rise=0.02, run=1.0, count=1, start=0.3))
    swing = 0.1 / 0.5
    assert 0.02 * (1.0 - 2.0 * SPACING / swing) <= riser.height <= 0.02
    assert riser.is_cleared and not riser._replace(lift=0.02).is_cleared
    assert riser._replace(height=0.0195).advised_lift == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        ("--terrain", "moon", "stairs:RISE"), ("--terrain", "stairs:x", "a number instead of 'x'"),
        ("--terrain", "stair:0.02", "with its numbers. Did you mean 'stairs'?"),
        ("--terrain", "stairs", "or a TOML file with its numbers.\n"),
        ("--terrain", "bumps:0.02:a", "the seed an integer"),
        ("--terrain", "none.toml", "none.toml"), ("--payload", "heavy", "a number instead of"),
        ("--push", "20N", "FORCE@TIME"), ("--lost-leg", "xx", "xx"),
        ("--payload", "1kg@nolink", "nolink"),
    ],
)  # fmt: skip
def test_ground_and_loads_that_are_none(run: Run, option: str, text: str, said: str) -> None:
    done = run("walk", "kharagpur", *WALK, "--duration", "0.1", option, text)
    assert done.status == 2 and said in done.err and done.left == []


def test_ground_and_loads_reach_the_case(run: Run, tmp_path: Path) -> None:
    """Each option is what a case file says in full."""
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
    assert "18 joints: 'lf_coxa_joint', " in done.err and "zero velocity" in " ".join(
        done.err.split()
    )
    assert lines[-1] == "next: hexapod-pin walk slow.urdf --repair"
    (tmp_path / "cut.urdf").write_text(
        text.replace('<parent link="base_link"', '<parent link="none"')
    )
    refused = run("walk", "cut.urdf", *WALK)
    assert refused.status == 2 and refused.err.splitlines()[-1].endswith("check cut.urdf")


def test_without_a_command_there_is_what_to_type(run: Run) -> None:
    """Five ways in, one line each; every command named there exists."""
    done = run()
    assert done.status == 0 and max(map(len, done.out.splitlines())) <= WIDTH
    named = set(re.findall(r"hexapod-pin (\w+)", done.out))
    assert named == {"walk", "select", "compare", "sweep", "view"}
    listed = run("--help").out
    assert all(f"  {name} " in listed for name in named)


def test_no_line_of_any_command_wraps(
    run: Run, trace: hp.Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tables and sentences of up to 370 characters were printed as they were."""
    trace.save("walk.nc")
    scaled_inertias(tmp_path, 1000.0)
    budgets = ("--full", "--joints", "--assumed", "--catalog", "--catalog --full", "--motor AX-12A")
    wide = ["budget walk.nc --catalog --full", "budget walk.nc --motor AX-12A", "check scaled.urdf"]
    commands = [
        *(f"budget walk.nc {option}" for option in budgets), "stability walk.nc", "check athena",
        "check scaled.urdf", "repair scaled.urdf -o new.urdf", "contact accurate", "--help",
        "walk kharagpur --gait tripod --cycle-time 0.1", "walk scaled.urdf --mu x",
        "walk none.urdf", "select none",
        "sweep none.toml", "compare none.toml", "run none.toml", "budget none.nc", "view none.nc",
    ]  # fmt: skip
    for width, words in [*((80, one) for one in commands), *((120, one) for one in wide)]:
        monkeypatch.setenv("COLUMNS", str(width))
        done = run(*words.split())
        lines = (done.out + done.err).replace(f"{tmp_path}/", "").splitlines()
        assert lines and max(map(len, lines)) <= width, (words, max(lines, key=len))


def test_a_centre_of_mass_is_outside_its_feet_where_that_lasts(monkeypatch):
    """What is over within 20 ms, as between two feet, does not count; the least inside does."""
    time, module = 0.002 * np.arange(501), sys.modules["hexapod_pin.results.walk_answer"]

    def least(until: int) -> float | None:
        margins = np.full(len(time), 0.05)
        margins[100:until] = -0.4
        margins[200] = 0.03
        found = SimpleNamespace(static_margin=margins, time=time)
        monkeypatch.setattr(module, "stability", lambda _: found)
        return module._margin(None)

    assert least(100) == 0.03
    assert least(110) == 0.05  # ten samples of 2 ms
    assert least(111) == -0.4


def test_the_next_command_is_of_the_same_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    """`select` has its own walks: where robot or task are others, motors are ranked by the run."""
    trace = Path("walk.nc")
    for options, following in (
        (["--repair", "--out=a.nc", "--quick"], "hexapod-pin select my.urdf --repair"),
        (["--payload", "2kg"], "hexapod-pin budget walk.nc --catalog"),
        (["--repair", "--mass=2.5"], "hexapod-pin budget walk.nc --catalog"),
    ):
        monkeypatch.setattr(terminal, "_arguments", ["walk", "my.urdf", *options])
        assert following_command("my.urdf", trace, repair="--repair" in options) == following


def test_the_trial_with_a_repaired_file_assumes_its_gains_anew(run: Run, tmp_path: Path) -> None:
    """Gains of a robot of 3 g, by its weight, would let the repaired one fall."""
    path = scaled_masses(tmp_path, 1e-3)
    done = run("walk", path.name, *WALK, "--step", "2e-3")
    tried = " ".join(done.out.split()).split("tried with --repair, peaks are: ")[1]
    steps = ("--step", "2e-3", "--repair", "--json", "--out", "mended.nc")
    mended = run("walk", path.name, *WALK, *steps)
    budget = json.loads(mended.out)["budget"]
    for kind in budget["kinds"]:
        found = float(re.search(rf"{kind['kind']} ([\d.]+)", tried)[1])  # type: ignore[index]
        assert found == pytest.approx(kind["peak"]["torque_peak"], rel=5e-3)  # three digits

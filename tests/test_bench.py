"""Speed against error: measure, rounds, levels, reports, advice; other engines, and scenes."""

from __future__ import annotations

import csv
import importlib.util
import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from conftest import Run
from refusals import NUMBER, refused
from vehicles import HARD_CASES, drop, hexa_ref

import hexapod_pin as hp
from hexapod_pin.benchmark.advice import SAFETY_FACTOR, NoAdviceError, advise, advise_on
from hexapod_pin.benchmark.engines import engine as rivals_module
from hexapod_pin.benchmark.engines.engine import Problem, engine_entries, engine_urdf
from hexapod_pin.benchmark.report import BenchmarkReport, csv_text, json_text, level_table, markdown
from hexapod_pin.benchmark.work_precision import comparison
from hexapod_pin.benchmark.work_precision.comparison import ComparisonSettings, compare
from hexapod_pin.benchmark.work_precision.measure import (
    OURS,
    BenchmarkRow,
    ReferenceSolution,
    RunOutcome,
    cheapest,
    measure,
    ratios,
    sweeps,
)
from hexapod_pin.benchmark.work_precision.own_entry import (
    NoReferenceError,
    find_reference,
    known_answer,
    run_task,
)
from hexapod_pin.benchmark.work_precision.scenes import (
    SceneOptions,
    built_in,
    find_task,
    tripod_setpoints,
)
from hexapod_pin.benchmark.work_precision.task import Task, held_task, set_points
from hexapod_pin.errors import ParameterError, SimulationInterrupted, UnknownNameError
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting

STILL = np.array([[0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.3, -0.2]] * 3)


def row(value: float, error: float, wall: float, **rest) -> BenchmarkRow:
    numbers = {"uncertainty": 1e-12, "evaluations": None, "method": "a", "engine": OURS, "note": ""}
    numbers |= {"estimate": math.nan, "runs": 1, "steps": None, "rejected": None, **rest}
    return BenchmarkRow(
        setting=f"{value:g}", value=value, error=error, trunk=error, wall=wall, **numbers
    )


def test_distance_is_the_largest_of_place_turn_and_joints():
    moved = STILL.copy()
    moved[1, :3] += (3e-3, 4e-3, 0.0)
    found = PositionError.between(moved, STILL)
    assert (found.q, found.trunk) == pytest.approx((4e-3, 5e-3), rel=1e-12)
    a, b = pin.rpy.rpyToMatrix(0.3, -1.1, 2.0), pin.rpy.rpyToMatrix(-0.2, 0.4, 1.0)
    first, second = STILL.copy(), STILL.copy()
    first[2, 3:7], second[2, 3:7] = pin.Quaternion(a).coeffs(), -pin.Quaternion(b).coeffs()
    wanted = np.linalg.norm(pin.log3(b.T @ a))
    assert PositionError.between(first, second).q == pytest.approx(wanted, rel=1e-12)


def test_a_level_counts_only_if_every_tighter_setting_meets_it():
    own = [row(1e-2, 5e-5, 1.0), row(1e-3, 2e-4, 2.0), row(1e-4, 3e-5, 4.0), row(1e-5, 9e-6, 3.0)]
    assert cheapest(own, 1e-4).value == 1e-5  # 1e-2 met it by chance; 1e-5 is cheaper than 1e-4
    assert cheapest(own, 1e-3).value == 1e-2
    assert cheapest(own, 1e-6) is None
    broken = [*own[:2], row(1e-4, math.nan, 0.1), own[3]]
    assert cheapest(broken, 1e-3).value == 1e-5  # a diverged run meets nothing
    rows = [
        row(1e-3, 5e-4, 0.004), row(1e-4, 8e-5, 0.02, method="b"),
        row(1e-3, 7e-4, 0.020, engine="X", method="slow"),
        row(1e-3, 6e-4, 0.016, engine="X", method="fast"),
    ]  # fmt: skip
    first, second = ratios(rows)
    assert first.endswith("X 16 ms (fast, 0.001); ours 4 ms (a, 0.001), ratio 0.250")
    assert "no method of X reached it" in second
    rows = [row(1e-3, 1e-4, 1.0), row(1e-2, math.nan, math.nan, note="refused: no")]
    assert [one.value for one in sweeps(rows)[OURS, "a"]] == [1e-3]


def outcome(x: float, wall: float = 0.0) -> RunOutcome:
    q = STILL + np.eye(9)[0] * x
    return RunOutcome(q[:, :3], q, wall=wall, evaluations=50, steps=20, rejected=4)


@dataclass
class Fake:
    """An entry that takes a given time and counts its runs; Ctrl-C comes at one of them."""

    method: str
    wall: float
    log: list[str] = field(default_factory=list)
    stop_at: int = 10**9
    engine: str = OURS
    setting: str = "s"
    value: float = 1.0
    reference = ReferenceSolution(outcome(0.0), "t", PositionError(0, 0), "c")

    def run(self) -> RunOutcome:
        self.log.append(self.method)
        if len(self.log) >= self.stop_at:
            raise SimulationInterrupted("interrupted", None)
        return outcome(1e-3, self.wall + 1e-3 * self.log.count(self.method))


def test_rounds_are_interleaved_and_slow_runs_are_timed_once():
    log: list[str] = []
    fraction: list[float] = []
    found = measure([Fake("a", 0.01, log), Fake("b", 5.0, log)], 0.5, 3, fraction.append)
    assert "".join(log) == "abaaa" and fraction[-1] == 1.0 and not found.interrupted
    quick, slow = found.rows
    assert (quick.runs, slow.runs) == (3, 1)
    assert quick.wall == pytest.approx((0.01 + 3e-3) / 0.5)  # median of runs 2, 3, 4
    assert (quick.evaluations, quick.steps, quick.rejected) == (100.0, 40.0, 8.0)
    assert quick.error == pytest.approx(1e-3, rel=1e-12)
    early = measure([Fake("a", 0.0), Fake("b", 0.0, stop_at=1)], 1.0, 1)
    assert [one.method for one in early.rows] == ["a"] and early.interrupted


def test_reference_of_hc40_soft_is_the_published_end_state():
    """1e-7 is a tenth of what the hard case asks for; its own digits are good to 4e-13."""
    task = built_in("hc40-soft")
    reference = find_reference(task)
    assert known_answer(task, reference) < 1e-7 > reference.uncertainty.q
    assert known_answer(built_in("stand"), reference) is None


def test_what_cannot_be_measured_is_refused():
    with refused(NoReferenceError, about=("stand", "dop853", "ndf", "0")):
        find_reference(replace(built_in("stand"), duration=0.01), max_wall=0.0)
    with refused(UnknownNameError, kind="method", name="magic", about=("extrapolated-euler",)):
        compare(built_in("walk"), ComparisonSettings(["magic"]))
    for accuracy, piece in ((0.5, 0.1), (1e-3, 0.005)):
        with pytest.raises(ParameterError):
            advise(built_in("stand").scene, hp.HoldPosture(), accuracy, piece=piece)


def test_implicit_euler_on_hc40_is_first_order_and_costs_what_it_says():
    """Halving the step halves the error, within 25 %; evaluations are steps and one more."""
    task = built_in("hc40-soft")
    found = compare(task, ComparisonSettings(["implicit-euler"], rounds=1, quick=True))
    errors = [one.error for one in found.rows]
    assert errors[0] == pytest.approx(2.77e-3, rel=0.02)  # known: 2.6e-3 to 2.8e-3 at 1 ms
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.25)
    assert [one.steps for one in found.rows] == [1e3, 2e3, 4e3, 1e4]
    assert all(one.evaluations == one.steps + 4.0 for one in found.rows)
    assert level_table(found, "error").rows[0][2] == "not reached: 4e-04"


def test_a_run_that_diverges_is_a_row_that_says_so():
    found = run_task(built_in("hc40-soft"), SolverSetting("rk4", 5e-3))
    assert not found.ended and found.note.startswith("diverged after 0")
    assert math.isnan(found.distance(found).q)


def test_csv_and_json_hold_the_same_rows():
    task = replace(built_in("walk"), duration=0.05)
    found = compare(task, ComparisonSettings(["implicit-euler", "rk4"], rounds=1, quick=True))
    report = BenchmarkReport(Machine.here(), "hexapod-pin bench walk", [found])
    for text in (markdown(report), csv_text(report), json_text(report)):
        for part in (report.machine.packages["mujoco"], report.machine.cpu, report.machine.date):
            assert part in text
    table = csv.DictReader(x for x in csv_text(report).splitlines() if not x.startswith("#"))
    rows = json.loads(json_text(report))["scenes"][0]["rows"]
    assert [flat["error"] for flat in table] == [
        "" if full["error"] is None else repr(full["error"]) for full in rows
    ]


SHORT = ("--duration", "0.02", "--rounds", "1", "--quick", "--methods", "implicit-euler")


def test_command_prints_tables_and_writes_report_and_figure(run: Run):
    done = run("bench", "walk", "stand", *SHORT, "--out", "r.md", "--plot", "f.svg")
    assert (done.status, done.err, done.left) == (0, "", ["f.svg", "r.md"])
    page = Path("r.md").read_text()
    for text in (done.out, page):
        assert text.count("reference: ") == 2 and "step 0.25 ms" in text and "evaluations" in text
    assert page.count("| implicit-euler | step 1 ms | ") == 2
    assert "`hexapod-pin bench walk stand --duration 0.02 --methods implicit-euler" in page
    assert Path("f.svg").read_text().count("<svg") == 1


def test_command_refuses_before_it_measures(run):
    for words, says in (
        (("--out", "r.txt"), ".md, .csv, .json"), (("--methods", "rk4,magic"), "'magic'"),
        (("--rounds", "1001"), "--rounds"),
    ):  # fmt: skip
        done = run("bench", "walk", *words)
        assert (done.status, done.out, done.left) == (2, "", []) and says in done.err


def test_ctrl_c_writes_what_is_done_and_ends_with_130(run, monkeypatch: pytest.MonkeyPatch):
    real = comparison.compare

    def interrupted(task, *rest):
        if task.name == "stand":
            raise KeyboardInterrupt
        return real(task, *rest)

    monkeypatch.setattr(comparison, "compare", interrupted)
    done = run("bench", "walk", "stand", *SHORT, "--out", "r.json")
    assert (done.status, done.left) == (130, ["r.json"]) and "interrupted" in done.err
    assert [one["name"] for one in json.loads(Path("r.json").read_text())["scenes"]] == ["walk"]


WALK = replace(built_in("walk"), duration=0.06)


def test_advised_run_keeps_the_error_it_predicts():
    advice, task = advise_on(WALK, 1e-3), WALK
    trace = hp.simulate(
        task.scene, task.controller, duration=task.duration, sample=task.sample,
        initial=task.initial, **advice.settings,
    )  # fmt: skip
    error = PositionError.between(trace.q, advice.reference.outcome.q).q
    assert error == advice.predicted_error  # the same run, bit for bit
    assert error * SAFETY_FACTOR <= 1e-3
    per_second = trace.counters["evaluations"] / task.duration
    assert advice.evaluations == pytest.approx(per_second, rel=1e-12)
    tried = sweeps(advice.tried)
    good = [cheapest(own, 1e-3 / SAFETY_FACTOR) for own in tried.values()]
    times = {row.method: row.wall * 1e3 for row in good if row is not None}
    assert times[advice.method] == advice.milliseconds == min(times.values())
    assert len(tried) > 1 and advice.method in advice.table()
    assert str(advice).startswith(f'for an error of 0.001: method="{advice.method}", ')


def test_what_nothing_reaches_is_refused_with_what_came_nearest(monkeypatch):
    monkeypatch.setattr("hexapod_pin.benchmark.advice.method_names", lambda: ("implicit-euler",))
    wanted = 1e-8 / SAFETY_FACTOR
    with refused(NoAdviceError, about=(f"{wanted:.1e}", "0.06")) as caught:
        advise_on(WALK, 1e-8)
    assert float(NUMBER.findall(str(caught.value))[2]) > wanted  # what came nearest


# other engines and scenes -------------------------------------------------------------------------


def engine(module: str, task: Task):
    pytest.importorskip(module)
    name = module.removeprefix("py") if module == "pydrake" else module
    found = importlib.import_module(f"hexapod_pin.benchmark.engines.{name}_engine")
    return getattr(found, name.capitalize())(Problem.of(task))


def flight(limited: bool = False) -> Task:
    """The walk's robot 1 m up, tilted, moving and turning, its servos at work, for 50 ms."""
    task = built_in("walk")
    robot, q = task.scene.robot, task.initial.q + np.eye(len(task.initial.q))[2]
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.4, 0.9)).coeffs()
    v = 0.3 * np.random.default_rng(5).standard_normal(robot.model.nv)
    v[:6] = (0.4, -0.2, 0.1, 0.5, -0.8, 1.1)
    goals = [robot.posture + 0.1, robot.posture - 0.1]
    controller = hp.motion.SampledTrajectory([0.0, 0.02], goals, limited=False)
    scene = replace(task.scene, servo=hp.Servo(kp=20.0, kd=0.3, limited=limited))
    state = robot.check_state(q, v)
    return replace(task, scene=scene, initial=state, duration=0.05, controller=controller)


def test_urdf_for_other_engines_is_the_same_body():
    random, robot = np.random.default_rng(5), hp.load_robot("kharagpur")
    text = engine_urdf(robot, robot.damping).replace("continuous", "revolute")
    text = text.replace("<limit ", '<limit lower="-9" upper="9" ')
    other = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    assert list(other.names) == list(robot.model.names) and text.count("<sphere ") == 6
    q = pin.integrate(other, pin.neutral(other), random.standard_normal(other.nv))
    theirs, ours = ((model, model.createData(), q) for model in (other, robot.model))
    assert np.triu(pin.crba(*theirs)) == pytest.approx(np.triu(pin.crba(*ours)), abs=1e-14)
    gravity = pin.computeGeneralizedGravity(*ours)
    assert pin.computeGeneralizedGravity(*theirs) == pytest.approx(gravity, abs=1e-13)


@pytest.mark.parametrize(
    ("module", "method", "tolerance", "limited"),
    [
        ("mujoco", "RK4 pyramidal", 1e-8, False), ("mujoco", "RK4 pyramidal", 1e-8, True),
        ("mujoco", "implicitfast elliptic", 5e-5, False), ("pydrake", "SAP", 5e-5, True),
        ("pybullet", "torque servo", 5e-5, True),
    ],
)  # fmt: skip
def test_engines_agree_in_flight(module, method, tolerance, limited):
    """First-order engines fall g h t/2 wrong, 2.5e-5 m at 0.1 ms; RK4 is at round-off."""
    task = flight(limited)
    ours = run_task(task, SolverSetting("rk4", 1e-4))
    other = engine(module, task).run(method, "step", 1e-4, exact=True)
    assert other.ended and other.steps == 500, other.note
    assert np.abs(ours.places[-1] - ours.places[0]).max() > 0.01
    assert other.places == pytest.approx(ours.places, abs=tolerance)


def test_mujoco_stands_where_we_stand():
    """Dropped by 10 mm, at rest after 0.4 s: a soft foot's depth, 1 mm, is the laws' difference."""
    task = replace(built_in("stand"), duration=0.4)
    ours = run_task(task, SolverSetting("implicit-euler", 1e-3))
    other = engine("mujoco", task).run("Euler elliptic", "step", 1e-3)
    assert other.places[-1] == pytest.approx(ours.places[-1], abs=1.2e-3)


def test_a_diverging_mujoco_run_is_a_note_and_leaves_no_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    task = replace(built_in("walk"), duration=0.1)
    found = engine("mujoco", task).run("RK4 pyramidal", "step", 5e-3)
    assert not found.ended and found.note.startswith("diverged: ")
    assert list(tmp_path.iterdir()) == []


def test_what_engines_cannot_be_compared_on_is_refused():
    soft, stand = built_in("hc40-soft"), built_in("stand")
    with refused(ParameterError, "depth of a foot at t = 0", 0.006125, allowed=(0.0001,)):
        Problem.of(soft)
    with refused(ParameterError, "radius of L1_foot", 0.0):
        Problem.of(replace(soft, initial=hp.load_robot("athena").stand()))
    with refused(ParameterError, "terrain", "slope"):
        Problem.of(replace(stand, scene=replace(stand.scene, terrain=hp.Slope(angle=0.1))))
    found = engine_entries(soft, quick=True)
    assert found.entries == [] and "no other engines" in found.notes[0]


def test_engines_that_are_not_installed_are_named(monkeypatch):
    monkeypatch.setattr(rivals_module, "find_spec", lambda name: None)
    found = engine_entries(built_in("walk"), quick=True)
    assert "MuJoCo: not installed (pip install mujoco)" in found.notes and len(found.notes) == 3


def test_ours_and_mujoco_stand_in_one_table_with_their_ratio(monkeypatch):
    monkeypatch.setattr(rivals_module, "find_spec", {"mujoco": "there"}.get)
    monkeypatch.setattr("hexapod_pin.benchmark.engines.mujoco_engine.QUICK_STEPS", (1e-3, 5e-4))
    task = replace(built_in("walk"), duration=0.1)
    settings = ComparisonSettings(["implicit-euler"], rounds=1, quick=True, engines=True)
    found = compare(task, settings)
    assert {one.engine for one in found.rows} == {"hexapod_pin", "MuJoCo"}
    methods = {one.method for one in found.rows if one.engine == "MuJoCo"}
    integrators, cones = ("implicitfast", "Euler", "RK4"), ("pyramidal", "elliptic")
    assert methods == {f"{a} {b}" for a in integrators for b in cones}
    assert len(found.references) == 3  # ours, and one per cone
    assert any("ratio" in line for line in found.ratios)


def test_hc40_soft_is_the_hard_case_itself():
    task, (scene, state, posture) = built_in("hc40-soft"), drop(hexa_ref())
    assert (task.initial.q == state.q).all() and (task.initial.v == state.v).all()
    assert (task.scene.contact, task.scene.servos) == (scene.contact, scene.servos)
    assert (task.controller.plan(task.scene.robot, task.duration).q == posture).all()
    answer = HARD_CASES["HC40_hexapod_drop_soft"]["ref"]
    assert task.answer[7:] == pytest.approx(answer["q_joints_pin_order"], abs=0.0)
    assert task.answer[:3] == pytest.approx(answer["base_xyz"], abs=0.0)
    mid = built_in("hc40-mid")
    normal, friction = mid.scene.contact.normal, mid.scene.contact.friction
    assert (normal.stiffness, friction.slope) == (1e6, 1e3)
    assert (normal.dissipation, friction.mu) == (0.5, 0.5)
    assert (mid.initial.q == task.initial.q).all() and mid.answer is None


def test_walk_starts_10_mm_above_the_ground_with_100_held_set_points():
    """The tripod swings and lifts as by hand: t = 0.25 s, a = 90 degrees; t = 1 s, a = 0."""
    task = built_in("walk")
    robot = task.scene.robot
    assert task.initial.q[2] - robot.stand().q[2] == pytest.approx(0.010, abs=1e-15)
    assert (task.samples, task.sample, len(task.controller.time)) == (100, 0.01, 100)
    assert set_points(task) == pytest.approx(np.array(task.controller.q), abs=0.0)
    quarter, full = tripod_setpoints(robot, np.array([0.25, 1.0]))
    for leg, swing, lift in (("lf", 0.25, -0.25), ("rm", -0.25, -0.25), ("rf", 0.25, 0.0)):
        angles = ((quarter, "coxa", swing), (full, "femur", lift), (full, "tibia", -lift))
        for row, kind, angle in angles:
            k = robot.joint_index(f"{leg}_{kind}_joint")
            assert row[k] - robot.posture[k] == pytest.approx(angle, abs=1e-15)


def test_a_gait_is_held_from_sample_to_sample_for_all_engines():
    options = SceneOptions(gait="tripod", cycle_time=0.8, stroke=0.05, duration=0.3)
    task = find_task("kharagpur", options)
    plan = task.controller.plan(task.scene.robot, 0.3)
    rows = np.round(plan.time / 0.01).astype(int)
    knots = np.isclose(plan.time, 0.01 * rows) & (rows < 30)
    assert knots.sum() > 10
    assert set_points(held_task(task))[rows[knots]] == pytest.approx(plan.q[knots], abs=1e-9)


def test_what_a_scene_does_not_take_is_refused(tmp_path: Path):
    for scene, options, name, value in (
        ("walk", SceneOptions(contact="s1"), "--contact", "s1"),
        ("walk", SceneOptions(duration=1.5), "--duration", 1.5),
        ("kharagpur", SceneOptions(sample=1e-9, duration=0.02), "sample", 1e-9),
        ("kharagpur", SceneOptions(gait="hold", stroke=0.1), "--stroke", 0.1),
        ("nothing.toml", SceneOptions(kp=1.0), "--kp", 1.0),
    ):
        with refused(ParameterError, name, value):
            find_task(scene, options)
    with refused(ParameterError, "sample", 0.02):
        set_points(replace(built_in("walk"), sample=0.02, duration=0.1))
    with refused(UnknownNameError, kind="gait", name="gallop", about=("tetrapod",)):
        find_task("kharagpur", SceneOptions(gait="gallop"))
    with refused(UnknownNameError, name="nothing", about=("hc40-soft", "athena")):
        find_task("nothing", SceneOptions())
    (tmp_path / "mine.toml").write_text(built_in("walk").scene.to_toml())
    assert find_task(str(tmp_path / "mine.toml"), SceneOptions(gait="hold")).name == "mine"

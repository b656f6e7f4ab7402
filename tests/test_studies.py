"""Studies run, shortened, and write their files; MuJoCo has our robot; S1 is judged."""

from __future__ import annotations

import dataclasses
import json
import re
import shlex
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest
from studies.__main__ import main, study_paths
from studies.cost.mujoco_twin import MujocoTwin
from studies.cost.native_motion import NativeMotion
from studies.cost.step_cost import OURS, SAMPLED
from studies.cost.step_entries import MUJOCO, PINOCCHIO
from studies.foot_control.cells import DRY, LEAST_TORQUE, OWN, Cell, Size, cells, draws
from studies.foot_control.judgement import SHOWN, CellChange
from studies.foot_control.s1_comparison import (
    s1_comparison,
)
from studies.foot_control.variants import (
    BOTH_WAYS,
    NO_PARTS,
    PID,
    SOLE_UNKNOWN,
    TARGETS,
)
from studies.kills import sweep_kills
from studies.study import StudyReport, run_study
from studies.sweeps import simulated_workers
from studies.sweeps.loopback_cluster import Cluster, cluster_processes
from studies.walks.first_lines import PACKAGED

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.benchmark.engines.mujoco_engine import CONES
from hexapod_pin.commands.contact_report import restitution_table
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.drive.catalog.catalog import Catalog
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.interchange.mjcf_text import MjcfOptions
from hexapod_pin.results.walk_metrics import Estimate
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.text_table import Table
from hexapod_pin.validation.checks.limit_checks import _rigid

ROOT = Path(__file__).resolve().parents[1]
STEP = 1e-3


def few_motors() -> Catalog:
    """Return a sixth of the catalogue, with the two motors that a study asks for by name."""
    whole = hp.load_catalog()
    named = [whole.get(model, 12.0) for model in ("STS3215-C018", "MX-64")]
    return Catalog((*named, *(row for row in whole.records[::6] if row not in named)), "a sixth")


SHORT = {
    name: shlex.split(words)
    for name, words in {
        "batch": "--cases 6 --diverging 1 --duration 0.1 --share 2",
        "closed_loop_cost": (
            "--duration 0.05 --rounds 1 --steps 0.005 --controls yielding "
            "--robots kharagpur --accuracy 1e-3"
        ),
        "command_kills": "--kills 1 --signals 0 --only walk --duration 0.3",
        "constraint_drift": "--duration 0.02 --rounds 1 --solves 1",
        "contact_cost": "--duration 0.05 --rounds 1",
        "creep": "--duration 0.05",
        "first_lines": "--most 2",
        "formulations_cost": "--rounds 1 --stiffnesses 1",
        "gain_borders": (
            "--robots kharagpur --contacts accurate --quantities slip.kp --delays 20 --points 1"
        ),
        "real_robots": "--duration 2.4",
        "learning_cost": "--duration 0.04 --rounds 1 --resets 4",
        "mjcf_walks": "--robots kharagpur --cycles 4",
        "killed_walk": "--hours 0.001 --pieces 2 --kills 1",
        "one_hour": "--cycles 2",
        "peak_sampling": (
            "--robots athena --gaits tripod --contacts s1 --cycle-time 0.8 --tight 1e-5"
        ),
        "peak_verdicts": (
            "--robots kharagpur --gaits tripod --contacts accurate --cycle-time 0.8 "
            "--cycles 1 --accuracy 1e-2"
        ),
        "plan_at_ticks": "--quick",
        "prescribed_cost": (
            "--rounds 1 --robots kharagpur --contacts s1 --walks tetrapod "
            "--accuracies 1e-2 --factors 1"
        ),
        "predictability": (
            "--duration 0.2 --long 0.2 --robots athena --gaits tripod --grounds flat --drawn 1"
        ),
        "promise": "--scenes 2 --seed 3 --kinds bouncing,sliding --accuracies 1e-4,1e-5",
        "promise_cases": "--cases limp --only 0 --forces 0",
        "promise_drives": "--scenes 1 --seed 11 --accuracies 1e-3 --methods extrapolated-euler",
        "promise_orders": '--scenes "patch edge, stiffness" --accuracies 1e-4,1e-5,1e-6',
        "promise_walks": (
            "--durations 0.2 --robots athena --gaits tetrapod --presets accurate "
            "--accuracies 1e-4 --explicit-for 0"
        ),
        "robust_cost": "--quick",
        "s1_comparison": "--quick --draws 1 --seed 112",
        "second_rhs": "--groups friction --most 1 --tolerance 1e-7",
        "servo_pendulum": "--accuracy 1e-3",
        "step_cost": "--quick",
        "sweep_cost": "--cases 4 --duration 0.1 --dask 0 --samples 0",
        "sweep_scale": (
            "--cases 100 --simulated 4 --walks 4 --duration 0.05 --most 0 --saturating 2"
        ),
        "sweep_kills": "--kills 2 --cases 4 --duration 0.1",
        "motor_criterion": "--robots kharagpur --accuracy 1e-3",
        "motor_feedback": "--walks 1",
        "backlash": "--plays 0 --checked 0 --accuracy 3e-3",
        "walk_tracking": "--quick",
        "unknown_ground": "--quick",
        "tolerance_calibration": "--drops 1 --methods extrapolated-euler",
    }.items()
}
"""Options with which a study is short."""

FOOT_CONTROL, SUITE = "studies.foot_control.standing_growth", "hexapod_pin.benchmark.hard_suite"

SMALLER = {
    "constraint_drift": {"studies.accuracy.constraint_drift.STEPS": (4e-3, 2e-3)},
    "first_lines": {"studies.walks.first_lines.PACKAGED": (PACKAGED[0], PACKAGED[7])},
    "formulations_cost": {
        "hexapod_pin.validation.checks.limit_checks._rigid": lambda control, duration, _: _rigid(
            control, duration, 1e-2
        ),
        "hexapod_pin.validation.checks.limit_checks.SLOW_TRIPOD": hp.Gait.tripod(
            stroke=0.02, cycle_time=1.0
        ),
    },
    "gain_borders": {
        f"{FOOT_CONTROL}.SETTLED": 2.0, f"{FOOT_CONTROL}.BISECTIONS": 1,
        f"{FOOT_CONTROL}.ACCURACY": 1e-6,
    },
    "killed_walk": {"studies.kills.killed_walk.FIRST_PIECE": 0.5},
    "learning_cost": {
        "studies.cost.learning_cost.TOGETHER": 2,
        "studies.cost.learning_cost.MUJOCO": {"held": (2e-3, False), "moving": (2e-3, True)},
    },
    "motor_criterion": {"studies.walks.motor_criterion.load_catalog": cache(few_motors)},
    "plan_at_ticks": {"studies.cost.plan_at_ticks.PERIODS": (0.04, 0.02, 0.01)},
    "prescribed_cost": {
        "studies.cost.prescribed_torque.EXACT": {"method": "ndf", "accuracy": 1e-5},
        "studies.cost.prescribed_cost.NARROW_ACCURACY": 1e-2,
    },
    "s1_comparison": {
        "studies.foot_control.cells.SWING": {"kharagpur": (0.2, 0.25)},
        "studies.foot_control.cells.CYCLES": 3.1,
    },
    "tolerance_calibration": {f"{SUITE}.WALK_DURATION": 0.1, f"{SUITE}.DROP_DURATION": 0.1},
    "walk_tracking": {
        "studies.walks.walk_tracking.FIRST_CYCLE": 1, "studies.walks.walk_tracking.CYCLES": 1,
    },
}  # fmt: skip
"""Numbers of the modules of a study that are no options, smaller."""

FIGURES = ("backlash", "constraint_drift", "gain_borders")
"""Studies that draw a figure beside their page."""

ELSEWHERE = {
    "contact_energy": "tests/test_contact_matrix.py",
    "contact_matrix": "tests/test_contact_matrix.py",
    "expected_failures": "all hard cases: an hour",
    "hc40_references": "ten minutes",
    "moving_picture": "a minute of a browser; docs/walk.gif, whose size test_documents.py checks",
    "restitution_table": "below, as a command",
    "rewritten_robots": "tests/test_rewritten.py",
    **{f"s2_{name}": "tests/test_s2_study.py" for name in
       ("energy", "mass_center", "motion", "page", "study", "sweeps", "torques")},
}  # fmt: skip
"""Studies that write no page of docs/results/, and where they are run, or why not."""


RECORDING = {
    "mass": 0.49, "length": 0.1, "kp": 200, "vin": 7.4, "trajectory": "made up",
    "columns": ["timestamp", "position", "speed", "goal_position", "torque_enable"],
    "rows": [
        [0.0, 0.1, 0.0, 0.1, True], [0.03, 0.12, 0.5, 0.3, False], [0.06, 0.1, 0.0, 0.3, False],
    ],
}  # fmt: skip
"""Of a pendulum whose motor is switched off."""


@pytest.fixture(scope="module")
def walking() -> NativeMotion:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return NativeMotion.of(scene, hp.KinematicControl(hp.Gait.tripod()), 0.5)


def test_studies_are_listed_and_run_by_one_command() -> None:
    """As a user does it: neither scripts/ nor tests/ is where Python looks for modules."""

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(ROOT / "scripts" / "studies"), *words]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert study_paths().keys() == SHORT.keys() | ELSEWHERE.keys()
    assert re.findall(r"^  (\w+)  ", run().stdout, re.MULTILINE) == list(study_paths())
    assert run("restitution_table").stdout == restitution_table() + "\n"
    assert run("no_such_study").returncode == 2


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """Give a Dask scheduler with two workers of one thread, which two studies use in turn."""
    with cluster_processes(2, 1) as found:
        yield found


@pytest.mark.slow
@pytest.mark.parametrize("name", SHORT)
def test_study_writes_its_page(
    name: str, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch, request
) -> None:
    """Command and machine in the head, no host, no path; the page is printed too."""
    places = {name: ["--figure", "f.svg"] for name in FIGURES}
    places["sweep_scale"] = ["--page", "scale.md"]
    places["real_robots"] = ["--folder", "robots"]
    places["servo_pendulum"] = ["--data", "recordings.json"]
    (tmp_path / "recordings.json").write_text(json.dumps([RECORDING]))
    (tmp_path / "robots").mkdir()
    shutil.copy(urdf_path("kharagpur"), tmp_path / "robots")
    for number, smaller in SMALLER.get(name, {}).items():
        monkeypatch.setattr(number, smaller)
    if name in ("sweep_kills", "sweep_scale"):
        cluster = request.getfixturevalue("cluster")
        monkeypatch.setattr(sweep_kills, "loopback_cluster", lambda _: nullcontext(cluster.address))
        monkeypatch.setattr(simulated_workers, "cluster_processes", lambda *_: nullcontext(cluster))
    words = list(SHORT[name])
    if name in places:
        words += [places[name][0], str(tmp_path / places[name][1])]
    assert main([name, *words, "--out", str(tmp_path)]) in (0, 1)
    page = (tmp_path / f"{name}.md").read_text()
    assert capsys.readouterr().out.strip() == page.strip()
    assert f"`python scripts/studies {name} {' '.join(SHORT[name])}" in page
    assert "Python 3" in page and "Load" in page and "\n| --- |" in page
    assert socket.gethostname() not in page and str(ROOT) not in page
    if name == "step_cost":
        require_speeds_and_errors(json.loads((tmp_path / "step_cost.json").read_text()))


def require_speeds_and_errors(found: dict) -> None:
    """An error for every entry and motion, and the same bits."""
    assert found["same_bits"] is True and found["dense_difference"] < 1e-9
    rows = {(row["motion"], row["entry"]): row for row in found["rows"]}
    for entry in (OURS, SAMPLED, *MUJOCO, PINOCCHIO):
        for motion in ("stand/s1", "tripod/s2", "tetrapod/s1"):
            values = rows[motion, entry]["us_per_step"]
            assert len(values) == found["size"]["rounds"] and min(values) > 0.0
    for (_, entry), row in rows.items():
        if entry in (OURS, *MUJOCO):  # a 1 ms walk that lost the robot would be off by centimetres
            assert 0.0 < row["error"]["first_second"] <= row["error"]["whole"] < 5e-3
            assert row["error"]["counters"]["steps"] == round(found["size"]["duration"] / STEP)


def test_options_and_exit_status_of_a_study(tmp_path: Path) -> None:
    def sample(*, count: int = 3, name: str = "a", fast: bool = False) -> StudyReport:
        table = Table("Numbers", ("n",), [(str(k),) for k in range(count)])
        return StudyReport("Sample", [f"{name} {fast}", table], {"count": count}, met=fast)

    where = ["--out", str(tmp_path)]
    assert run_study(sample, ["--count", "2", "--fast", *where]) == 0
    page = (tmp_path / "sample.md").read_text()
    assert page.startswith("# Sample\n\n`python scripts/studies sample --count 2 --fast`\n")
    assert "a True" in page and "## Numbers\n\n| n |\n| --- |\n| 0 |\n| 1 |" in page
    assert json.loads((tmp_path / "sample.json").read_text())["count"] == 2
    assert run_study(sample, where) == 1


def test_mujoco_has_our_robot_and_servos(walking: NativeMotion) -> None:
    """In the air: the same accelerations to 1e-9; condition numbers are 1e5, torques limited."""
    scene = dataclasses.replace(walking.scene, stops=hp.JointStops(stiffness=0.0))  # as the twin
    twin = MujocoTwin(scene, MjcfOptions(STEP))
    dof = [twin.model.joint(name).dofadr[0] for name in scene.robot.joint_names]
    plant, servo, effort = native_plant(scene), scene.servos, scene.robot.effort_limit
    rng = np.random.default_rng(3)
    limited = 0
    for _ in range(20):
        quaternion = rng.normal(size=4)
        base = np.concatenate([[0.0, 0.0, 9.0], quaternion / np.linalg.norm(quaternion)])
        angles, rates = rng.uniform(-1.0, 1.0, 18), rng.normal(size=18)
        state = scene.robot.check_state(
            np.concatenate([base, angles]), np.concatenate([rng.normal(size=6), rates])
        )
        q_ref, v_ref = angles + rng.normal(size=18) * 0.02, rates + rng.normal(size=18)
        torque = servo.kp * (q_ref - angles) + servo.kd * (v_ref - rates)
        limited += int((np.abs(torque) > effort).sum())
        ours = native.evaluate(plant, state.q, state.v, np.clip(torque, -effort, effort))
        twin.put(state)
        twin.data.ctrl[:] = twin.controls(lambda t, q=q_ref, v=v_ref: (q[None], v[None]), 0, 1)[0]
        mujoco.mj_forward(twin.model, twin.data)
        theirs = np.concatenate([twin.data.qacc[3:6], twin.data.qacc[dof]])
        assert np.abs(ours["acceleration"][3:] - theirs).max() <= 1e-9 * np.abs(theirs).max()
    assert 0 < limited < 20 * 18


def test_timed_runs_are_the_checked_runs(walking: NativeMotion) -> None:
    """What is timed ends, bit for bit, where the run whose error is printed ends: both engines."""
    steps = 500
    checked = walking.path(STEP, steps * STEP).positions
    run = walking.rollout(STEP, steps)
    assert run.advance(1)
    np.testing.assert_array_equal(run.checkpoint().q[:3], checked[-1])
    assert len(run.record()["time"]) == 2
    for cone in CONES:
        twin = MujocoTwin(walking.scene, MjcfOptions(STEP, cone=cone))
        twin.timed_run(walking.state, walking.set_points, steps)()
        end = np.array(twin.data.qpos[:3])
        path = twin.path(walking.state, walking.set_points, steps * STEP)
        np.testing.assert_array_equal(end, path.positions[-1])


GOOD = {
    "slip_distance": -0.5, "energy_per_metre": -0.15, "vertical_acceleration_rms": -0.3,
    "torque_rms": 0.01, "torque_peak": 0.02, "roll_rms": -0.1, "pitch_rms": -0.1,
    "force_peak": 0.0,
}  # fmt: skip
CELL = Cell("athena", LEAST_TORQUE, "bumps", "accurate")


def changed(variant: str = TARGETS, cell: Cell = CELL, half: float = 0.04, **values: float):
    """Return changes that meet everything, but for some values."""
    changes = {name: Estimate({**GOOD, **values}[name], half, 10) for name in SHOWN}
    return CellChange(cell, 0.005, variant, (10, 10), changes)


@pytest.mark.parametrize(
    ("values", "missed"),
    [
        ({}, []),
        ({"slip_distance": -0.03}, ["slip path"]),  # the interval goes up to +1 %
        ({"energy_per_metre": 0.01}, ["energy"]),
        ({"torque_rms": 0.03, "torque_peak": 0.07}, ["torque RMS", "torque peak"]),
        ({"roll_rms": 0.05}, []),  # not surely above 2 %
        ({"roll_rms": 0.07, "pitch_rms": 0.1}, ["roll", "pitch"]),
        ({"half": 0.09, "torque_peak": 0.02}, ["torque peak"]),
        ({"cell": replace(CELL, terrain="flat"), "slip_distance": -0.03}, []),
    ],
)
def test_force_targets_are_held_to_the_numbers(values, missed: list[str]) -> None:
    assert changed(**values).missed() == missed


def test_other_variants_have_rules_of_their_own() -> None:
    lost = replace(changed(), walked=(9, 10))
    assert lost.missed() == ["a run that did not walk"]
    own = replace(CELL, posture=OWN)
    assert changed(PID).missed() is None
    assert changed(cell=own).missed() is None
    assert changed(cell=replace(CELL, terrain="soil"), slip_distance=-0.03).missed() == []
    assert changed(cell=replace(CELL, terrain="patches"), torque_rms=0.03).missed() == [
        "torque RMS"
    ]
    assert changed(SOLE_UNKNOWN, torque_rms=0.5).missed() == []
    assert changed(SOLE_UNKNOWN, slip_distance=0.01).missed() == ["slip path"]
    assert changed(BOTH_WAYS, own, torque_rms=0.04, torque_peak=0.11).missed() == ["torque RMS"]
    nothing = dict.fromkeys(GOOD, 0.005)
    assert changed(NO_PARTS, **nothing).missed() == []
    assert changed(NO_PARTS, **{**nothing, "roll_rms": -0.02}).missed() == ["roll"]
    assert replace(changed(NO_PARTS), tick=0.002).missed() is None


def test_draws_repeat_and_can_be_walked_in_all_postures() -> None:
    robots = {OWN: hp.load_robot("kharagpur")}
    grounds = ("bumps", "soil", DRY)
    size = Size(
        ("kharagpur",), (OWN,), grounds, ("accurate", "s1"), (0.005,),
        dict.fromkeys(grounds, 4), 3, {},
    )  # fmt: skip
    with pytest.raises(UnknownNameError):
        s1_comparison(grounds="flat,water")
    first, again = (draws(robots, "kharagpur", "bumps", size) for _ in range(2))
    assert [(one.gait, one.seed) for one in first] == [(one.gait, one.seed) for one in again]
    fewer = draws(robots, "kharagpur", "bumps", replace(size, draws={"bumps": 2}))
    assert [one.seed for one in fewer] == [one.seed for one in first[:2]]
    assert len({one.seed for one in first}) == 4
    for one in first:
        refuse_impossible(robots[OWN], one.gait)
    assert [cell.contact for cell in cells(size)] == ["accurate", "s1", "soil", "accurate", "s1"]

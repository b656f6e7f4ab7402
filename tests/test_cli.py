"""The commands: what they print and leave, and how they refuse."""

from __future__ import annotations

import io
import json
import math
import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import Run

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.control.gait import GAITS
from hexapod_pin.errors import DivergenceError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.simulation.methods import METHODS

WALK = ("walk", "kharagpur", "--gait", "tripod", "--cycle-time", "0.8", "--stroke", "0.05")
SHORT = ("--duration", "3.2")  # two cycles to start, two steady ones


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """One short walk, and all it left."""
    folder, out, err = tmp_path_factory.mktemp("walk"), io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.chdir(folder)
        with pytest.raises(SystemExit) as exit_:
            main((*WALK, *SHORT, "--full"))
    return SimpleNamespace(
        folder=folder,
        trace=folder / "walk.nc",
        status=exit_.value.code,
        out=out.getvalue(),
        err=err.getvalue(),
    )


def test_walk_prints_its_table_and_leaves_the_trace_of_the_library(walked: SimpleNamespace):
    """The command adds nothing: same samples, bit for bit."""
    assert (walked.status, walked.err) == (0, "")
    assert "stroke 0.05 m (as given)" in walked.out
    for row in ("coxa", "femur", "tibia", "rr_tibia_joint", "[N m]", "assumed: "):
        assert row in walked.out
    assert "wrote walk.nc, walk.html" in walked.out
    assert sorted(path.name for path in walked.folder.iterdir()) == ["walk.html", "walk.nc"]
    assert (walked.folder / "walk.html").read_text().lstrip().lower().startswith("<!doctype html>")
    scene = hp.Scene(hp.load_robot("kharagpur"))
    gait = hp.Gait.tripod(stroke=0.05, cycle_time=0.8)
    direct = hp.simulate(scene, hp.KinematicControl(gait), duration=3.2)
    stored = hp.load_trace(walked.trace)
    assert (stored.q == direct.q).all()
    assert (stored.torque == direct.torque).all()


def test_a_saved_case_repeats_the_walk_to_the_bit(run: Run):
    options = "--duration 0.4 --mu 0.6 --kp 21 --save-case case.toml --no-html".split()
    assert (run(*WALK, *options).status, run("run", "case.toml", "--no-html").status) == (0, 0)
    first, again = hp.load_trace("walk.nc"), hp.load_trace("run.nc")
    for name in ("time", "q", "v", "torque", "foot_force"):
        assert (getattr(first, name) == getattr(again, name)).all(), name
    case = hp.load_case("case.toml")
    assert hp.load_case(first) == hp.load_case(again) == case
    assert case.scene.contact.friction.mu == 0.6 and case.scene.servos.kp == 21.0


def test_stroke_that_does_not_fit_is_replaced_in_the_open(run: Run):
    """Without --stroke, a gait that cannot do 0.14 m takes 80 % of its largest, with a note."""
    options = "--heading 90 --foot-radius 0 --duration 0.2 --no-html".split()
    done = run(*WALK[:-2], *options)
    assert done.status == 0, done.err
    said = " ".join(done.out.split())
    assert re.search(r"stroke [\d.]+ mm \(80% of the longest that fits, [\d.]+ mm\)", said)


def test_options_reach_the_scene_and_degrees_are_radians_inside(run: Run):
    """--heading 90 walks to the left, --turn-rate 5 is 5 degrees a second."""
    options = "--contact s2 --mu 0.6 --kp 21 --kd 0.5 --foot-radius 0.01 --no-html"
    walk = "--method rk4 --step 2e-5 --duration 0.02 --heading 90 --turn-rate 5 --stroke 0.02"
    assert run(*WALK[:-2], *options.split(), *walk.split()).status == 0
    trace = hp.load_trace("walk.nc")
    scene = hp.load_case(trace).scene
    assert isinstance(scene.contact.normal, hp.contact.AdamsImpact)
    assert scene.contact.friction.mu_static == 0.6
    assert scene.contact.friction.mu_dynamic == pytest.approx(0.2, rel=1e-12)  # ratio of S2
    assert (scene.servos.kp, scene.servos.kd, scene.servos.assumed) == (21.0, 0.5, False)
    assert (trace.run.numerics.method, trace.run.numerics.step) == ("rk4", 2e-5)
    assert set(trace.run.robot.foot_radius) == {0.01}
    assert trace.run.walk.travel_direction == pytest.approx((0.0, 1.0), abs=1e-12)
    assert trace.run.walk.turn_rate == pytest.approx(math.radians(5.0))


def test_budget_prints_a_table_or_json(run: Run, walked: SimpleNamespace):
    trace = str(walked.trace)
    assert "femur" in run("budget", trace).out
    done = run("budget", trace, "--json")
    assert done.status == 0
    assert json.loads(done.out) == hp.torque_budget(hp.load_trace(trace)).to_dict()


def test_check_lists_what_is_found_and_every_fault_of_a_file(run: Run, tmp_path: Path):
    """Two planted faults are both named, on stderr, with status 2."""
    done = run("check", "kharagpur")
    assert (done.status, done.err) == (0, "")
    for text in ("18 move", "leg lf: lf_coxa_joint", "foot rr_foot: sphere", "assumed: "):
        assert text in done.out
    sound = hp.urdf_path("kharagpur").read_text()
    faulty = sound.replace('<mass value="0.041"/>', '<mass value="-1"/>', 1)
    faulty = re.sub(
        r'(<joint name="rr_tibia_joint".*?<axis xyz=)"[^"]*"', r'\1"0 0 0"', faulty, flags=re.S
    )
    (tmp_path / "faulty.urdf").write_text(faulty)
    done = run("check", "faulty.urdf")
    assert (done.status, done.out) == (2, "")
    assert "femur" in done.err and "rr_tibia_joint" in done.err


REFUSALS = {
    "unknown robot": (("walk", "spider"), "spider"),
    "unknown foot": (("check", "kharagpur", "--feet", "left_shoe"), "left_shoe"),
    "no foot name": (("check", "kharagpur", "--feet", ","), "--feet"),
    "joints too slow": ((*WALK[:-4], "--cycle-time", "0.1"), "--cycle-time must be at least"),
    "undamped stiffness": (
        ("walk", "kharagpur", "--kp", "1e7"),
        "--kp = 10000000.0: must be at most 2.4e+06 N m/rad where kd is 4.8 N m s/rad. Its time "
        "constant kd / kp is 4.8e-07 s, so hardly damped it swings so fast that a walk takes "
        "minutes: --kd 2e+05 damps it.",
    ),
    "endless duration": ((*WALK, "--duration", "inf"), "duration"),
    "no duration": ((*WALK, "--duration", "0"), "--duration = 0.0: must be above 0 s. Left out"),
    "short option": (("walk", "x", "-o", "x"), "No such option: -o (Possible options: --out)"),
    "missing trace": (("budget", "nowhere.nc"), "nowhere.nc"),
    "missing folder": (("walk", "kharagpur", "--out", "gone/walk.nc"), "--out"),
}


@pytest.mark.parametrize(("options", "culprit"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal_is_one_message_with_status_2(run: Run, options: tuple[str, ...], culprit: str):
    """It names the culprit, shows no traceback, and leaves no file."""
    done = run(*options)
    assert done.status == 2
    assert culprit in done.err
    assert "Traceback" not in done.err + done.out
    assert done.left == []


@pytest.mark.parametrize("command", ["budget", "view"])
def test_damaged_trace_is_refused_by_name(run: Run, walked: SimpleNamespace, command: str):
    whole = walked.trace.read_bytes()
    Path("bad.nc").write_bytes(whole[: len(whole) // 2])
    done = run(command, "bad.nc")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("hexapod-pin: ") and "bad.nc" in done.err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_folder_is_refused_before_the_simulation(run: Run, tmp_path: Path):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o555)
    done = run("walk", "kharagpur", "--out", "locked/walk.nc")
    assert (done.status, "not writable" in done.err) == (2, True)


def test_run_that_ends_early_keeps_its_trace(run, monkeypatch, walked):
    """Divergence saves what was done, prints where, and draws nothing."""
    partial = hp.load_trace(walked.trace)

    def simulate(*_: object, **__: object) -> hp.Trace:
        raise DivergenceError("stopped early", partial)

    monkeypatch.setattr("hexapod_pin.simulation.case.run_case", simulate)
    done = run("walk", "kharagpur", "--out", "part.nc")
    assert (done.status, done.left) == (2, ["part.nc"])
    assert done.err.startswith("hexapod-pin: stopped early") and "part.nc" in done.err
    assert hp.load_trace("part.nc") == partial


def test_ctrl_c_during_the_simulation_keeps_what_was_done(run, monkeypatch):
    """A real SIGINT in the middle of a run: status 130, and a readable trace that ends early."""

    @contextmanager
    def interrupting(_title: str) -> Iterator[Callable[[float], None]]:
        def progress(fraction: float) -> None:
            if fraction > 0.0:
                signal.raise_signal(signal.SIGINT)

        progress.stage = lambda _title: None  # type: ignore[attr-defined]
        yield progress

    monkeypatch.setattr("hexapod_pin.commands.progress.progress_bar", interrupting)
    done = run(*WALK, "--duration", "10")
    assert done.status == 130
    assert done.err.startswith("hexapod-pin: interrupted after ")
    assert done.left == ["walk.nc"]
    assert 0.0 < hp.load_trace("walk.nc").time[-1] < 10.0


def test_ctrl_c_before_the_simulation(run: Run, monkeypatch: pytest.MonkeyPatch):
    def load_robot(*_: object, **__: object) -> hp.Robot:
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("not reached")

    monkeypatch.setattr("hexapod_pin.robot.robot.load_robot", load_robot)
    done = run(*WALK)
    assert (done.status, done.left) == (130, [])
    assert done.err.startswith("hexapod-pin: interrupted")
    assert "Traceback" not in done.err


def test_help_and_version(run: Run):
    """Help texts are written out, so that `--help` imports nothing; the lists stand elsewhere."""
    done = run("--help")
    assert done.status == 0 and "budget" in done.out
    assert run("--version").out == f"hexapod-pin {hp.__version__}\n"
    listed = {"walk": (*GAITS, *METHODS, *PRESETS), "export": tuple(GAITS), "bench": tuple(GAITS)}
    for command, names in listed.items():
        text = run(command, "--help").out
        for name in names:
            assert re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", text), (command, name)

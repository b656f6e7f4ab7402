"""Every example runs as it stands, writes only into its folder, and says what is true."""

from __future__ import annotations

import importlib.util
import inspect
import math
import re
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)

    def run_one(name: str, files: tuple[str, ...] = (), **settings: Any) -> Any:
        main, folder = example(name).main, tmp_path / "out"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        given = {"folder": folder, **settings}
        found = main(**{k: x for k, x in given.items() if k in inspect.signature(main).parameters})
        assert sorted(path.name for path in folder.iterdir()) == sorted(files)
        assert [path.name for path in tmp_path.iterdir()] == ["out"]
        return found

    return run_one


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_each_says_what_it_shows_and_is_listed_and_tested(path: Path) -> None:
    module = example(path.stem)
    assert module.__doc__ and re.search("print|writes", module.__doc__, re.IGNORECASE)
    assert f"({path.name})" in (path.parent / "README.md").read_text(encoding="utf-8")
    assert f'run("{path.stem}"' in Path(__file__).read_text(encoding="utf-8")
    assert "import _" not in path.read_text(encoding="utf-8")


def test_robots_and_contacts(run) -> None:
    robot, damaged = run("load_a_robot", ("my_robot.urdf", "damaged.urdf", "reach.png"))
    assert robot.total_mass == pytest.approx(8.25)
    assert len(damaged.findings) == 1 and "lf_coxa" in damaged.findings[0]
    robot, budget = run("robot_from_dimensions", ("my_hexapod.urdf", "my_hexapod.html"))
    assert robot.total_mass == pytest.approx(1.2 + 6 * (0.08 + 0.10 + 0.06))
    assert budget.measured_speed == pytest.approx(0.12, rel=0.05)
    depth, closed = run("own_contact_parameters", ("own_contact_parameters.png",))
    np.testing.assert_allclose(depth, closed, rtol=1e-3)
    found = run("compare_two_laws", ("compare_two_laws.png",))
    assert abs(found["accurate"][0]) < 1e-6 and found["accurate"][1] == 0.0
    assert found["s2"][0] == pytest.approx(found["s2"][1], rel=0.01)
    trace = run("drop_test", ("drop_test.html",))
    touch = trace.time[trace.contact.any(axis=1)][0]
    assert touch == pytest.approx(math.sqrt(2.0 * 0.05 / 9.81), abs=2e-3)
    assert trace.normal_force[-1].sum() == pytest.approx(8.25 * 9.81, rel=0.01)


def test_walks(run) -> None:
    trace = run("walk", ("walk.nc", "walk.html"))
    assert hp.torque_budget(trace).measured_speed == pytest.approx(0.0875, rel=0.02)  # S2's gait
    assert hp.load_trace("out/walk.nc") == trace
    traces = run("walk_on_terrain", ("walk_on_terrain.png",))
    way = {name: trace.com[-1] - trace.com[0] for name, trace in traces.items()}
    assert way["slope"][2] == pytest.approx(math.tan(math.radians(8.0)) * way["slope"][0], abs=2e-3)
    assert abs(way["level"][2]) < 2e-3 and way["ice"][0] < 0.9 * way["slope"][0]
    budgets = run("choose_a_gait", ("choose_a_gait.png",))
    rms = {name: budget.kind("femur").rms.torque_rms for name, budget in budgets.items()}
    assert rms["tripod"] > rms["tetrapod"] > rms["wave"]  # more feet, less torque
    rows = run("sweep_a_parameter", ("sweep.csv", "sweep.png"))
    assert [speed for _, _, speed, _ in rows] == pytest.approx([0.08 / 0.6] * 6, rel=0.05)
    carried, weight = run("foot_forces", ("foot_forces.csv", "foot_forces.png"))
    assert [carried, weight] == pytest.approx([3.08746 * 9.81] * 2, rel=1e-3)
    budget = run("own_gait", ("own_gait.html",))
    assert budget.measured_speed == pytest.approx(0.05, rel=0.02)
    assert run("plot_torque", ("torque.png",)).read_bytes().startswith(b"\x89PNG")
    assert run("save_and_continue", ("first_half.nc", "save_and_continue.png")) == 0.0
    errors = run("accuracy_and_speed", ("accuracy_and_speed.png",))
    assert errors["accuracy 1e-06"] < 1e-5 < errors["method robust, step 0.001"]


def test_controllers(run) -> None:
    sag = run("height_hold", ("height_hold.png",))
    assert 1e-3 < sag["empty, posture held"] < sag["0.5 kg, posture held"] - 2e-4 < 4e-3
    assert abs(sag["0.5 kg, height held"]) < 0.15 * sag["0.5 kg, posture held"]
    lean = run("gait_with_correction", ("gait_with_correction.png",))
    assert lean["plan alone"] == pytest.approx(0.08, rel=0.05)  # with the ramp
    assert lean["corrected"] < 0.1 * lean["plan alone"]
    tilt = run("foot_finds_no_ground", ("foot_finds_no_ground.html",))
    assert tilt["reaching"] < 0.6 * tilt["plan alone"]
    height = run("own_controller", ("own_controller.png",))
    assert height.min() == pytest.approx(-0.02, abs=1e-3)  # the servos yield
    files = ("policy.txt", "learned_walk.html")
    found = run("train_policy", files, generations=2, duration=1.0)
    assert found["trained"] > found["standing"] + 0.05  # the best of 24 policies of two generations


@pytest.mark.slow
def test_uncertain_walk(run, capsys, tmp_path_factory) -> None:
    text = example("uncertain_walk").STUDY.read_text(encoding="utf-8")
    fewer = tmp_path_factory.mktemp("study") / "study.toml"
    fewer.write_text(text.replace("samples = 16", "samples = 4"), encoding="utf-8")
    found = run("uncertain_walk", ("uncertain_walk.png",), study=fewer)
    assert (found.walks, found.failed) == (8, 0)
    assert found.indices.total[0] < 0.15  # a tripod that does not slip: friction hardly matters
    assert found.sentence in capsys.readouterr().out


@pytest.mark.slow
def test_own_study(run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It runs, and goes on, on threads and on worker processes, with the same bits."""
    angle, torque = run("own_study", ("own_study.html",))
    assert 0.2 < angle < 0.5 and 1.0 < torque < 10.0
    monkeypatch.syspath_prepend(ROOT / "examples")
    own = importlib.import_module("own_study")
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=0.4))
    for how in ({"processes": 1}, {"threads": 1, "resume": True}):
        found = hp.run_study(
            own.steepest, hp.load_robot("kharagpur"), walk, store=tmp_path / "a.db", **how
        )
        assert found == (angle, torque)


def test_the_first_code_block_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", text, re.DOTALL)
    assert found is not None
    exec(compile(found.group(1), "README.md", "exec"), {"__name__": "readme"})
    assert capsys.readouterr().out == found.group(2)

"""The native core beside a second right-hand side in Python, integrated by SciPy, law by law."""

from __future__ import annotations

import ast
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from oracles import second_rhs
from oracles.second_rhs import LawScene, SecondRun, difference, integrate
from oracles.second_rhs.contact_scenes import friction_scenes, ground_scenes, normal_scenes
from oracles.second_rhs.drive_scenes import drive_scenes
from oracles.second_rhs.prescribed_side import TorquePeaks

import hexapod_pin as hp
from hexapod_pin.validation.cases.bodies import on_ground, particle, state

RTOL = 1e-9
OWN = 1.5e-8
"""SciPy's own error at RTOL [m, rad]: 1e-8 at most over these scenes (the study's table)."""

LIMITS = {("dop853", 1e-9): 1e-8, ("ndf", 1e-7): 6e-7, ("extrapolated-euler", 1e-5): 6e-5}
"""What the core may add [m, rad]: landings and rebounds amplify what was asked up to six times. A
wrong law is off by 1e-5 at least."""

NORMAL, FRICTION, GROUND, DRIVE = (
    normal_scenes(), friction_scenes(), ground_scenes(), drive_scenes()
)  # fmt: skip


def agrees(scene: LawScene) -> SecondRun:
    run = scene.by_scipy(RTOL)
    for (method, accuracy), limit in LIMITS.items():
        apart = difference(scene, run.q, method=method, accuracy=accuracy).q
        assert apart < limit + OWN, (method, apart)
    return run


@pytest.mark.parametrize(
    "name",
    ["hunt-crossley", "kelvin-voigt", "adams-impact", "adams-impact s2", "restitution exact"],
)
def test_normal_law(name: str) -> None:
    run = agrees(NORMAL[name])
    assert run.count("touching") >= 1
    assert (run.count("pushes") > 0) == (name in ("kelvin-voigt", "adams-impact"))
    assert (run.count("deep") > 0) == (name == "adams-impact")


@pytest.mark.parametrize("name", ["tanh-coulomb", "adams-coulomb", "smooth-step", "brown-mcphee"])
def test_friction_law(name: str) -> None:
    run = agrees(FRICTION[name])
    assert (run.count("piece") > 0) == (name in ("adams-coulomb", "smooth-step"))


@pytest.mark.parametrize(
    ("name", "method", "accuracy", "limit"),
    [("stick-slip", "dop853", 1e-11, OWN), ("stick-slip dynamic", "ndf", 1e-10, 1e-5)],
)
def test_bristle(name: str, method: str, accuracy: float, limit: float) -> None:
    """It sticks and slides three times; with equal coefficients the second ends 1e-3 m off."""
    run = FRICTION[name].by_scipy(RTOL)
    assert run.count("sliding") >= 4
    assert difference(FRICTION[name], run.q, method=method, accuracy=accuracy).q < limit


@pytest.mark.parametrize("name", GROUND)
def test_ground(name: str) -> None:
    run = agrees(GROUND[name])
    assert (run.count("patch") > 0) == (name == "patched")
    assert (run.count("pushes") > 0) == (name in ("shaken", "shaken slope"))


def test_a_foot_that_comes_back_over_the_edge_of_a_patch() -> None:
    """Its bristle draws it back; it counts as back 0.01 mm behind the edge."""
    run = agrees(ground_scenes("stick-slip")["patched"])
    crossed = [(one.before, one.after) for one in run.switches if one.what == "patch"]
    assert crossed[-1] == crossed[-2][::-1]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("linear set-points", ""), ("torque cap, jumping set-points", "limit"),
        ("torque-speed line", "limit"), ("line and dry friction", "dry"),
        ("elastic stops", "stop"), ("push and payload", ""),
    ],
)  # fmt: skip
def test_drive(name: str, what: str) -> None:
    run = agrees(DRIVE[name])
    assert not what or run.count(what) >= 3


# Prescribed joints: the torques of S2's walk, as the page of its study gives them.

S2_PEAKS = {"coxa": 0.466, "femur": 1.379, "tibia": 0.1155}
"""Of docs/results/s2_study.md, over whole cycles from 2.4 s on, of the worst leg [N m]."""


@pytest.fixture(scope="module")
def s2_walk() -> hp.Trace:
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=hp.Contact.s2(), prescribed=True)
    motion = hp.motion.paper_motion(robot, stroke=0.14)
    return hp.simulate(
        scene, motion, duration=4.8, method="ndf", accuracy=1e-8, sample=2e-4
    )  # fmt: skip


@pytest.mark.parametrize("kind", S2_PEAKS)
def test_torque_peaks_of_prescribed_joints(s2_walk: hp.Trace, kind: str) -> None:
    """20 ms about each peak. Steps of 0.2 ms may miss the top of a peak by 0.1 %, no more."""
    steady = s2_walk.time > 2.4 - 1e-9
    torque = np.abs(np.where(steady[:, None], s2_walk.torque, 0.0))
    own = [j for j, name in enumerate(s2_walk.joint_names) if kind in name]
    row, joint = divmod(int(torque[:, own].argmax()), len(own))
    case, peaks = hp.load_case(s2_walk), TorquePeaks(18)
    run = integrate(
        case.scene, case.controller, duration=0.02, sample=0.005, tolerance=1e-6,
        initial=hp.State(s2_walk.q[row - 50], s2_walk.v[row - 50]),
        start=float(s2_walk.time[row - 50]), longest_step=2e-4, observe=peaks,
    )  # fmt: skip
    found = peaks.peak
    assert found[own[joint]] == pytest.approx(torque[row, own[joint]], rel=1e-3)
    assert found[own[joint]] == pytest.approx(S2_PEAKS[kind], rel=2e-3)  # its printed digits
    np.testing.assert_allclose(run.q[-1], s2_walk.q[row + 50], rtol=0, atol=1e-8)


def test_it_asks_nothing_of_the_native_core() -> None:
    """No file imports modules whose formulas it writes again, or names a law's native form."""
    own = ("native", "drive.drive_law", "formulations", "scene.loaded_model", "simulation.session")
    formulas = tuple(f"hexapod_pin.{name}" for name in own)
    assert all(map(find_spec, formulas))
    folder = Path(second_rhs.__file__).parent
    for path in folder.glob("*.py"):
        tree = ast.parse(path.read_text())
        names = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not names & {"native", "eta", "coefficient"}, path.name
        assert not {m for m in modules if m and m.startswith(formulas)}, path.name


# Bounces whose force the clamp takes away and gives back within one contact.

LAW = hp.contact.AdamsImpact(stiffness=6e8, exponent=1.5, damping=1132.0, damping_depth=1.16e-4)


@cache
def bounces() -> tuple[LawScene, SecondRun]:
    robot = particle()
    scene, start = on_ground(robot, LAW), state(robot, (0.0, 0.0, 0.05))
    law_scene = LawScene("bounces", scene, hp.HoldPosture(), start, 0.4, 0.05)
    run = law_scene.by_scipy(1e-11)
    assert [run.count(what) for what in ("touching", "pushes", "deep")] == [8, 2, 6]
    return law_scene, run


@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "dop853"])
def test_the_core_keeps_its_accuracy(method: str, accuracy: float) -> None:
    scene, run = bounces()
    assert difference(scene, run.q, method=method, accuracy=accuracy).q < accuracy

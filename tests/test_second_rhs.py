"""The native core beside a second right-hand side in Python, integrated by SciPy, law by law."""

from __future__ import annotations

import ast
import math
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from oracles import second_rhs
from oracles.second_rhs import LawScene, SecondRun, difference, integrate
from oracles.second_rhs.contact_scenes import friction_scenes, ground_scenes, normal_scenes
from oracles.second_rhs.drive_scenes import drive_scenes
from oracles.second_rhs.long_scenes import long_scenes
from oracles.second_rhs.normal_force import restitution_damping
from oracles.second_rhs.prescribed_side import TorquePeaks
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.validation.cases.bodies import on_ground, particle, state

RTOL = 1e-9
OWN = 1.5e-8
"""SciPy's own error at RTOL [m, rad]: 1e-8 at most over these scenes (the study's table)."""

LIMITS = {("dop853", 1e-9): 1e-8, ("ndf", 1e-7): 6e-7, ("extrapolated-euler", 1e-5): 6e-5}
"""What the core may add [m, rad]: landings and rebounds amplify what was asked up to six times. A
wrong law is off by 1e-5 at least: see the last tests."""

NORMAL, FRICTION, GROUND, DRIVE = (
    normal_scenes(), friction_scenes(), ground_scenes(), drive_scenes()
)  # fmt: skip
BRISTLES = ("stick-slip", "stick-slip dynamic")


def agrees(scene: LawScene) -> SecondRun:
    """Return SciPy's run, which the core's methods agree with."""
    run = scene.by_scipy(RTOL)
    for (method, accuracy), limit in LIMITS.items():
        apart = difference(scene, run.q, method=method, accuracy=accuracy).q
        assert apart < limit + OWN, (method, apart)
    return run


@pytest.mark.parametrize("name", NORMAL)
def test_normal_law(name: str) -> None:
    """A body lands on one foot: touched at least once, the clamps and pieces of ADAMS met."""
    run = agrees(NORMAL[name])
    assert run.count("touching") >= 1
    assert (run.count("pushes") > 0) == (name in ("kelvin-voigt", "adams-impact"))
    assert (run.count("deep") > 0) == (name == "adams-impact")


@pytest.mark.parametrize("name", [name for name in FRICTION if name not in BRISTLES])
def test_friction_law(name: str) -> None:
    """The foot slips at up to 0.15 m/s, across the laws' break points."""
    run = agrees(FRICTION[name])
    assert (run.count("piece") > 0) == (name in ("adams-coulomb", "smooth-step"))


def test_bristle() -> None:
    """It sticks and slides three times; where that is not located errors are 1e-7 at 1e-10."""
    scene = FRICTION["stick-slip"]
    run = scene.by_scipy(RTOL)
    assert run.count("sliding") >= 4
    assert difference(scene, run.q, method="dop853", accuracy=1e-11).q < OWN


def test_bristle_with_a_smaller_dynamic_coefficient() -> None:
    """The force jumps where it starts to slide. Equal coefficients would end 1e-3 m from here."""
    scene = FRICTION["stick-slip dynamic"]
    run = scene.by_scipy(RTOL)
    assert run.count("sliding") >= 4
    assert difference(scene, run.q, method="ndf", accuracy=1e-10).q < 1e-5


@pytest.mark.parametrize("name", GROUND)
def test_ground(name: str) -> None:
    """Slopes, patches that the foot slides across, and ground that shakes it off."""
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
    """A leg of three joints in flight: its drives reach and leave their modes."""
    run = agrees(DRIVE[name])
    assert not what or run.count(what) >= 3


def test_a_spring_of_kelvin_and_voigt_is_a_sine() -> None:
    """The second right-hand side itself: z = (g/w^2)(cos wt - 1) - v sin(wt)/w, w^2 = K/m."""
    robot, rate, speed = particle(0.5), 400.0, 0.1
    normal = hp.contact.KelvinVoigt(stiffness=0.5 * rate**2, damping=0.0)
    scene = on_ground(robot, normal)
    run = integrate(
        scene, hp.HoldPosture(), duration=0.006, sample=0.001, tolerance=1e-10,
        initial=state(robot, (0.0, 0.0, -1e-15), (0.0, 0.0, -speed)),
    )  # fmt: skip
    t = np.linspace(0.0, 0.006, 7)
    wanted = 9.81 / rate**2 * (np.cos(rate * t) - 1.0) - speed / rate * np.sin(rate * t)
    np.testing.assert_allclose(run.q[:, 2], wanted, atol=1e-12)


def test_a_foot_that_slides_on_its_bristle_is_slowed_by_the_dynamic_coefficient() -> None:
    """Coulomb's v t - mu_d g t^2/2 from the start of the slide on, at its static depth."""
    robot, mass = particle(0.5), 0.5
    friction = hp.contact.StickSlip(mu=0.4, mu_dynamic=0.25, stiffness=1e4, damping=20.0)
    scene = on_ground(robot, hp.contact.KelvinVoigt(stiffness=1e4, damping=50.0), friction=friction)
    run = integrate(
        scene, hp.HoldPosture(), duration=0.04, sample=0.01, tolerance=1e-10,
        initial=state(robot, (0.0, 0.0, -mass * 9.81 / 1e4), (0.5, 0.0, 0.0)),
    )  # fmt: skip
    t = np.linspace(0.0, 0.04, 5)
    np.testing.assert_allclose(run.q[:, 0], 0.5 * t - 0.125 * 9.81 * t**2, atol=1e-11)


def test_a_bristle_lets_go_on_a_slope_where_the_closed_form_says() -> None:
    """Stuck x'' = g sin - (k x + c x')/m until that is mu N; then x'' = g (sin - mu_d cos)."""
    scene = long_scenes()["slide on a slope"]
    run, t = scene.by_scipy(1e-9), np.linspace(0.0, 0.2, 9)
    (slip,) = run.switches
    pull, press = 9.81 * np.sin(0.6), 9.81 * np.cos(0.6)
    half, rate = 20.0, np.sqrt(2e4 - 20.0**2)  # c/(2 m), damped frequency
    rest = pull / 2e4

    def stuck(s: float) -> tuple[float, float]:
        fade, wave = np.exp(-half * s), np.array([np.cos(rate * s), np.sin(rate * s)])
        x = rest * (1.0 - fade * (wave[0] + half / rate * wave[1]))
        return x, rest * fade * (half**2 / rate + rate) * wave[1]

    x0, v0 = stuck(slip.time)
    assert 2e4 * x0 + 40.0 * v0 == pytest.approx(0.5 * press, rel=1e-9)
    later = t - slip.time
    slid = x0 + v0 * later + 0.5 * (pull - 0.3 * press) * later**2
    wanted = np.where(later > 0.0, slid, [stuck(s)[0] for s in t])
    downhill = -(run.q[:, :3] - run.q[0, :3]) @ np.array([np.cos(0.6), 0.0, np.sin(0.6)])
    np.testing.assert_allclose(downhill, wanted, atol=1e-10)


# Prescribed joints: the torques of S2's walk, as the page of its study gives them.

S2_PEAKS = {"coxa": 0.466, "femur": 1.379, "tibia": 0.1155}
"""Of docs/results/s2_study.md, over whole cycles from 2.4 s on, of the worst leg [N m]."""

DENSE = 2e-4
"""Spacing of the core's samples, from which the second right-hand side starts [s]."""


@pytest.fixture(scope="module")
def s2_walk() -> hp.Trace:
    """Return two cycles of S2's walk by the core; every cycle after the first is the same."""
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=hp.Contact.s2(), prescribed=True)
    motion = hp.motion.paper_motion(robot, stroke=0.14)
    return hp.simulate(
        scene, motion, duration=4.8, method="ndf", accuracy=1e-8, sample=DENSE
    )  # fmt: skip


def s2_again(trace: hp.Trace, start: int, duration: float, step: float) -> tuple[Array, Array]:
    """Return the torque peaks (18,) [N m] and the last q of a run from a sample of the core on."""
    case, peaks = hp.load_case(trace), TorquePeaks(18)
    run = integrate(
        case.scene, case.controller, duration=duration, sample=duration / 4, tolerance=1e-6,
        initial=hp.State(trace.q[start], trace.v[start]), start=float(trace.time[start]),
        longest_step=step, observe=peaks,
    )  # fmt: skip
    return peaks.peak, run.q[-1]


@pytest.mark.parametrize("kind", S2_PEAKS)
def test_torque_peaks_of_prescribed_joints(s2_walk: hp.Trace, kind: str) -> None:
    """20 ms about each peak. Steps of 0.2 ms may miss the top of a peak by 0.1 %, no more."""
    steady = s2_walk.time > 2.4 - 1e-9
    torque = np.abs(np.where(steady[:, None], s2_walk.torque, 0.0))
    own = [j for j, name in enumerate(s2_walk.joint_names) if kind in name]
    row, joint = divmod(int(torque[:, own].argmax()), len(own))
    found, q = s2_again(s2_walk, row - 50, 0.02, 2e-4)
    assert found[own[joint]] == pytest.approx(torque[row, own[joint]], rel=1e-3)
    assert found[own[joint]] == pytest.approx(S2_PEAKS[kind], rel=2e-3)  # its printed digits
    np.testing.assert_allclose(q, s2_walk.q[row + 50], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_torque_peaks_of_a_whole_cycle(s2_walk: hp.Trace) -> None:
    """Of all 18 joints; steps of 2 ms between switches miss sharp peaks by 1 % at most."""
    start = int(np.searchsorted(s2_walk.time, 2.4 - 1e-9))
    found, q = s2_again(s2_walk, start, 2.4, 2e-3)
    np.testing.assert_allclose(found, np.abs(s2_walk.torque[start:]).max(axis=0), rtol=1e-2)
    np.testing.assert_allclose(q, s2_walk.q[-1], rtol=0, atol=1e-7)


def test_exact_restitution_is_that_of_the_table() -> None:
    """Roots of ln((1 + a)/(1 - a e)) = a (1 + e), as tabulated to four digits."""
    table = {0.1: 9.998, 0.3: 3.087, 0.5: 1.4328, 0.8: 0.3731, 0.95: 0.0789}
    for e, wanted in table.items():
        assert restitution_damping("exact", e) == pytest.approx(wanted, abs=6e-5, rel=6e-5)


@pytest.mark.parametrize(
    ("part", "given", "value"),
    [("terrain", hp.Stairs(rise=0.01, run=0.2, count=2), "Stairs")],
)
def test_what_is_not_written_is_refused(part: str, given: object, value: object) -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), **{part: given})
    with refused(ParameterError, f"Scene.{part}", value):
        integrate(scene, hp.HoldPosture(), duration=0.01, initial=scene.robot.stand())


def test_durations_are_whole_numbers_of_samples() -> None:
    scene = NORMAL["kelvin-voigt"]
    with refused(ParameterError, "duration", 0.025):
        integrate(scene.scene, scene.controller, duration=0.025, initial=scene.initial)


FORMULAS = (
    "hexapod_pin.native",
    "hexapod_pin.drive.drive_law",
    "hexapod_pin.formulations",
    "hexapod_pin.scene.loaded_model",
    "hexapod_pin.simulation.session",
)
"""Modules whose formulas the oracle writes again; scenes, robots and plans may reach them."""


def test_it_asks_nothing_of_the_native_core() -> None:
    """No file imports the core or a law of it, or names a law's native form."""
    assert all(map(find_spec, FORMULAS))
    folder = Path(second_rhs.__file__).parent
    for path in folder.glob("*.py"):
        tree = ast.parse(path.read_text())
        names = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not names & {"native", "eta", "coefficient"}, path.name
        assert not {m for m in modules if m and m.startswith(FORMULAS)}, path.name


# Bounces whose force the clamp takes away and gives back within one contact.

LAW = hp.contact.AdamsImpact(stiffness=6e8, exponent=1.5, damping=1132.0, damping_depth=1.16e-4)
GRAVITY, DROP, END = 9.81, 0.05, 0.4
TIMES = np.linspace(0.0, END, 9)


def one_unknown() -> Array:
    """Return heights (9,) [m] of 1 kg: parabolas, and F - m g in steps of 1 us below."""

    def rate(_: float, y: Array) -> tuple[float, float]:
        depth = max(-y[0], 0.0)
        share = min(depth / LAW.damping_depth, 1.0)
        damping = LAW.damping * share**2 * (3.0 - 2.0 * share)
        return y[1], max(0.0, LAW.stiffness * depth**1.5 - damping * y[1]) - GRAVITY

    def leaves(_: float, y: Array) -> float:
        return float(y[0])

    leaves.terminal, leaves.direction = True, 1.0  # type: ignore[attr-defined]
    heights, t, z, v = np.zeros(9), 0.0, DROP, 0.0
    while True:
        fall = (v + math.sqrt(v * v + 2.0 * GRAVITY * z)) / GRAVITY
        flown = TIMES - t
        air = (flown >= 0.0) & (flown <= fall)
        heights[air] = (z + v * flown - 0.5 * GRAVITY * flown**2)[air]
        if t + fall >= END:
            return heights
        touch = (-1e-18, v - GRAVITY * fall)
        found = solve_ivp(
            rate, (t + fall, t + fall + 0.01), touch, method="DOP853",
            rtol=2.3e-14, atol=1e-17, events=[leaves], max_step=1e-6,
        )  # fmt: skip
        t, z, v = float(found.t[-1]), 0.0, float(found.y[1, -1])


@pytest.fixture(scope="module")
def heights() -> Array:
    """Of the equation in one unknown."""
    return one_unknown()


def bouncing() -> tuple[hp.Scene, hp.State]:
    """Return the scene and its start."""
    robot = particle()
    assert robot.total_mass == pytest.approx(1.0, rel=1e-15)
    return on_ground(robot, LAW), state(robot, (0.0, 0.0, DROP))


def test_the_second_right_hand_side(heights: Array) -> None:
    """In the first bounce the clamp acts, until near the surface the spring presses again."""
    scene, start = bouncing()
    run = integrate(
        scene, hp.HoldPosture(), duration=END, initial=start, sample=END / 8, tolerance=1e-12
    )
    assert [run.count(what) for what in ("touching", "pushes", "deep")] == [8, 2, 6]
    np.testing.assert_allclose(run.q[:, 2], heights, atol=2e-12)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "dop853"])
def test_the_core_keeps_its_accuracy(heights: Array, method: str, accuracy: float) -> None:
    """Over four bounces."""
    scene, start = bouncing()
    run = hp.simulate(
        scene, hp.HoldPosture(), duration=END, initial=start, sample=END / 8, method=method,
        accuracy=accuracy,
    )  # fmt: skip
    assert np.abs(run.q[:, 2] - heights).max() < accuracy
    assert run.accuracy_kept

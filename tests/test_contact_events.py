"""Switches within a run, located as events: adaptive methods meet closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import hexapod_pin as hp
from hexapod_pin.validation.cases import bodies
from hexapod_pin.validation.cases.slope import in_tilted_gravity

METHODS = ("extrapolated-euler", "ndf", "dop853")
G = 9.81
MU, MU_DYNAMIC, STIFFNESS, DAMPING = 0.5, 0.3, 2e4, 200.0
Motion = Callable[[float], tuple[float, float]]


def stuck(pull: float, u: float, z: float) -> Motion:
    """Speed and stretch after a time of 1 kg on a stuck bristle: u' = pull - k z - c u, z' = u."""
    matrix = np.array([[-DAMPING, -STIFFNESS], [1.0, 0.0]])
    rates, modes = np.linalg.eig(matrix)
    rest = np.array([0.0, pull / STIFFNESS])
    parts = np.linalg.solve(modes, np.array([u, z]) - rest)

    def at(t: float) -> tuple[float, float]:
        speed, stretch = rest + (modes @ (np.exp(rates * t) * parts)).real
        return float(speed), float(stretch)

    return at


def trial(speed: float, stretch: float) -> float:
    return STIFFNESS * stretch + DAMPING * speed


def bristle(dynamic: float) -> hp.contact.StickSlip:
    return hp.contact.StickSlip(mu=MU, mu_dynamic=dynamic, stiffness=STIFFNESS, damping=DAMPING)


def run(
    scene: hp.Scene, start: hp.State, duration: float, method: str, accuracy: float
) -> hp.Trace:
    return hp.simulate(
        scene, hp.HoldPosture(), duration=duration, initial=start, method=method,
        accuracy=accuracy, sample=0.01,
    )  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("accuracy", "dynamic"), [(1e-6, MU_DYNAMIC), (1e-6, MU), (1e-8, MU)],
    ids=["two coefficients", "one", "one, tight"],
)  # fmt: skip
def test_a_point_mass_breaks_away_when_its_bristle_says(method, accuracy, dynamic):
    """On 0.6 rad: stuck until k z + c u = mu N, then g sin - mu_dynamic g cos."""
    pull, normal, end = G * math.sin(0.6), G * math.cos(0.6), 0.5
    motion = stuck(pull, 0.0, 0.0)
    slip = brentq(lambda t: trial(*motion(t)) - MU * normal, 0.0, 0.02, xtol=1e-15)
    speed, stretch = motion(slip)
    left = end - slip
    expected = stretch + speed * left + 0.5 * (pull - dynamic * normal) * left**2
    case = in_tilted_gravity(math.tan(0.6), friction=bristle(dynamic))
    trace = run(case.scene, case.initial, end, method, accuracy)
    # velocity errors of steps, up to accuracy over 0.03 s, stay while it slides: ndf has some
    allowed = 12.0 if method == "ndf" else 1.5
    assert trace.q[-1, 0] == pytest.approx(expected, rel=0, abs=allowed * accuracy)
    assert trace.v[-1, 0] == pytest.approx(
        speed + (pull - dynamic * normal) * left, abs=40.0 * accuracy
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dynamic", [MU_DYNAMIC, MU], ids=["two coefficients", "one"])
def test_a_sliding_mass_sticks_again_where_its_slip_ends(method: str, dynamic: float) -> None:
    angle, v0, end, accuracy = math.atan(0.1), 1.0, 0.6, 1e-8
    pull, normal = G * math.sin(angle), G * math.cos(angle)
    held = dynamic * normal

    def sliding(t: float) -> tuple[float, float]:
        stretch = held / STIFFNESS * -math.expm1(-STIFFNESS / DAMPING * t)
        return v0 + (pull - held) * t, stretch

    stick = brentq(lambda t: trial(*sliding(t)) - held, 1e-3, 0.6, xtol=1e-15)
    speed, stretch = sliding(stick)
    travelled = v0 * stick + 0.5 * (pull - held) * stick**2
    expected = travelled + stuck(pull, speed, stretch)(end - stick)[1] - stretch
    case = in_tilted_gravity(0.1, (v0, 0.0), friction=bristle(dynamic))
    trace = run(case.scene, case.initial, end, method, accuracy)
    assert trace.q[-1, 0] == pytest.approx(expected, rel=0, abs=2.0 * accuracy)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accuracy", [1e-4, 1e-8])
def test_a_mass_that_slides_to_rest_does_not_slide_back(method: str, accuracy: float) -> None:
    """Under mu tanh(k v) it comes v^2/(2 mu g) + pi^2/(12 k^2 mu g) far, here in one sample."""
    k, v0, end = 1000.0, 1.0, 0.21
    friction = hp.contact.TanhCoulomb(mu=MU, slope=k)
    case = in_tilted_gravity(0.0, (v0, 0.0), friction=friction)
    trace = hp.simulate(
        case.scene, hp.HoldPosture(), initial=case.initial, duration=end, sample=end, method=method,
        accuracy=accuracy,
    )  # fmt: skip
    way = (v0**2 / 2.0 + math.pi**2 / (12.0 * k**2)) / (MU * G)
    assert trace.error is not None and trace.accuracy_kept
    assert abs(trace.q[-1, 0] - way) <= trace.error.position[-1] + 1e-12 <= accuracy + 1e-12
    assert abs(trace.v[-1, 0]) < accuracy


def test_feet_that_stand_on_the_edges_of_patches() -> None:
    """Middle feet on an edge, which soft ground on either side drives to the other."""
    rng, size = np.random.default_rng(5), 0.2
    corners = [(x, y) for x in (-0.4, -0.2, 0.0, 0.2) for y in (-0.4, -0.2, 0.0, 0.2)]
    patches = tuple(
        hp.terrain.Patch(
            low=(x, y), high=(x + size, y + size), stiffness=10 ** rng.uniform(-1.7, 0)
        )
        for x, y in corners
    )
    scene = hp.Scene(
        hp.load_robot("kharagpur"), contact=hp.Contact.preset("accurate"),
        terrain=hp.terrain.PatchedGround(ground=hp.Flat(), patches=patches),
    )  # fmt: skip
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=1.5))

    def walk(duration: float, **how: Any) -> hp.Trace:
        return hp.simulate(scene, control, duration=duration, sample=0.01, estimate=False, **how)

    truth = walk(0.2, method="dop853", accuracy=1e-8)
    fine, whole = walk(0.2, method="ndf", accuracy=1e-8), walk(0.2, method="ndf", accuracy=1e-4)
    np.testing.assert_allclose(fine.q, truth.q, rtol=0, atol=1e-7)
    np.testing.assert_allclose(whole.q, truth.q, rtol=0, atol=1e-4)
    assert whole.counters["events"] < 100
    first = walk(0.05, method="dop853", accuracy=1e-8)
    rest = walk(0.15, method="dop853", accuracy=1e-8, initial=first.checkpoint)
    np.testing.assert_array_equal(rest.q[-1], truth.q[-1])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
def test_a_mass_leaves_where_its_damper_would_pull(method: str, accuracy: float) -> None:
    """On a spring and a damper until K d + c d' = 0, with depth left; then it flies."""
    stiffness, damping, drop, end = 4000.0, 40.0, 0.1, 0.22
    touch = math.sqrt(2.0 * drop / G)
    matrix = np.array([[-damping, stiffness], [-1.0, 0.0]])  # of upward speed and depth, 1 kg
    rates, modes = np.linalg.eig(matrix)
    rest = np.linalg.solve(matrix, np.array([G, 0.0]))
    parts = np.linalg.solve(modes, np.array([-G * touch, 0.0]) - rest)

    def contact(t: float) -> tuple[float, float]:
        speed, depth = rest + (modes @ (np.exp(rates * t) * parts)).real
        return float(speed), float(depth)

    def force(t: float) -> float:
        speed, depth = contact(t)
        return stiffness * depth - damping * speed

    release = brentq(force, 0.02, 0.055, xtol=1e-15)
    speed, depth = contact(release)
    left = end - touch - release
    assert depth > 1e-3 and left > 1e-3
    robot = bodies.particle()
    scene = bodies.on_ground(
        robot, hp.contact.KelvinVoigt(stiffness=stiffness, damping=damping, exponent=1.0)
    )
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=end, initial=bodies.state(robot, (0.0, 0.0, drop)),
        method=method, accuracy=accuracy, sample=end, estimate=False,
    )  # fmt: skip
    assert trace.q[-1, 2] == pytest.approx(
        -depth + speed * left - 0.5 * G * left**2, rel=0, abs=accuracy
    )


def test_no_accuracy_is_too_tight_for_the_force_that_jumps_at_touch_down() -> None:
    """Its c d' acts at once: a step of an implicit method across it is not accurate, if short."""
    stiffness, damping, drop = 4000.0, 300.0, 0.2  # from 126 N s/m on it does not bounce
    robot = bodies.particle()
    law = hp.contact.KelvinVoigt(stiffness=stiffness, damping=damping, exponent=1.0)
    trace = hp.simulate(
        bodies.on_ground(robot, law), hp.HoldPosture(), duration=1.0, sample=1.0, method="ndf",
        accuracy=1e-12, initial=bodies.state(robot, (0.0, 0.0, drop)), estimate=False,
    )  # fmt: skip
    touch = math.sqrt(2.0 * drop / G)
    root = math.sqrt(damping**2 - 4.0 * stiffness)
    slow, fast = 0.5 * (damping - root), 0.5 * (damping + root)
    rest, rate, left = G / stiffness, G * touch, 1.0 - touch
    slow_part = (rate - fast * rest) / (fast - slow)
    depth = rest + slow_part * math.exp(-slow * left)  # the fast part has died away
    assert trace.q[-1, 2] == pytest.approx(-depth, rel=0, abs=1e-10)


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "robust"])
def test_sampled_forces_never_pull_nor_leave_the_cone(method: str) -> None:
    robot = hp.load_robot("kharagpur")
    friction = hp.contact.StickSlip(mu=0.7, mu_dynamic=0.5, stiffness=2e4, damping=60.0)
    scene = hp.Scene(
        robot, contact=hp.Contact(normal=hp.Contact.accurate().normal, friction=friction)
    )
    start, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    start[2] += 0.01
    v[:2] = 0.3, -0.1
    how = {"step": 1e-3} if method == "robust" else {"accuracy": 1e-5}
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=0.2, sample=2e-3, method=method,
        initial=hp.State(start, v), **how,
    )  # fmt: skip
    friction_force = np.linalg.norm(trace.tangential_force, axis=2)
    assert trace.normal_force.min() >= 0.0 and trace.normal_force.max() > 5.0
    assert np.all(friction_force <= 0.7 * trace.normal_force * (1.0 + 1e-12))

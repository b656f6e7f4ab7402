"""Switches within a run, located as events: adaptive methods meet closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import hexapod_pin as hp
from hexapod_pin.validation.cases import bodies
from hexapod_pin.validation.cases.slope import ELASTIC, in_tilted_gravity

METHODS = ("extrapolated-euler", "ndf", "dop853")
G = 9.81
MU, MU_DYNAMIC, STIFFNESS, DAMPING = 0.5, 0.3, 2e4, 200.0
BRISTLE = hp.contact.StickSlip(mu=MU, mu_dynamic=MU_DYNAMIC, stiffness=STIFFNESS, damping=DAMPING)
LIMP = hp.Servo(kp=0.0, kd=0.0, limited=False)
FREE = hp.JointStops(stiffness=0.0)
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
    """On 0.6 rad: stuck until k z + c u = mu N, then g sin - mu_dynamic g cos.

    With one coefficient the force has a kink there: a step over it is wrong at every accuracy.
    """
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
    """Slides at mu_dynamic N until its slip is zero, then rings on its bristle."""
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
@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8])
def test_a_mass_that_slides_to_rest_does_not_slide_back(method: str, accuracy: float) -> None:
    """Under mu tanh(k v) it comes v^2/(2 mu g) + pi^2/(12 k^2 mu g) far, here in one sample.

    All that three linear steps saw of a step across the rest was the same friction: the mass went
    on at -0.03 m/s, 9.2e-5 m off at any accuracy, and 1e-16 m was stated.
    """
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


@pytest.mark.parametrize("method", METHODS)
def test_a_block_crosses_the_edge_of_a_patch(method: str) -> None:
    """Decelerates by 0.5 g until x = 0.1 m and by 0.15 g from there."""
    v0, edge, end, accuracy = 1.5, 0.1, 0.3, 1e-8
    robot = bodies.particle()
    patch = hp.terrain.Patch(low=(edge, -1.0), high=(5.0, 1.0), friction=0.3)
    scene = bodies.on_ground(
        robot, ELASTIC, friction=hp.contact.TanhCoulomb(mu=0.5, slope=1000.0),
        terrain=hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)),
    )  # fmt: skip
    start = bodies.state(robot, (0.0, 0.0, -((G / ELASTIC.stiffness) ** (2 / 3))), (v0, 0.0, 0.0))
    crossing = (v0 - math.sqrt(v0**2 - 2.0 * 0.5 * G * edge)) / (0.5 * G)
    speed, left = v0 - 0.5 * G * crossing, end - crossing
    expected = edge + speed * left - 0.5 * 0.15 * G * left**2
    trace = run(scene, start, end, method, accuracy)
    assert trace.q[-1, 0] == pytest.approx(expected, rel=0, abs=accuracy)


@pytest.mark.parametrize("method", METHODS)
def test_a_block_comes_back_over_the_edge_of_a_patch(method: str) -> None:
    """Against SciPy: it crosses at x = 0.1 m, and is back 0.01 mm behind that.

    On tilted ground; crossing at the edge itself would be 1e-6 m away.
    """
    edge, width, pull, accuracy = 0.1, 1e-5, 2.0, 1e-8  # m, m, m/s^2
    robot = bodies.particle()
    patch = hp.terrain.Patch(low=(edge, -1.0), high=(5.0, 1.0), friction=0.2)
    scene = replace(
        bodies.on_ground(
            robot, ELASTIC, friction=hp.contact.TanhCoulomb(mu=0.1, slope=100.0),
            terrain=hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)),
        ), gravity=(-pull, 0.0, -G),
    )  # fmt: skip
    start = bodies.state(robot, (0.0, 0.0, -((G / ELASTIC.stiffness) ** (2 / 3))), (1.0, 0.0, 0.0))
    x, v, t, found = 0.0, 1.0, 0.0, []
    for mu, until, sign in ((0.1, edge, 1.0), (0.02, edge - width, -1.0), (0.1, -9.0, -1.0)):

        def there(_: float, y: Any, until: float = until) -> float:
            return y[0] - until

        there.terminal, there.direction = True, sign  # type: ignore[attr-defined]
        part = solve_ivp(
            lambda _, y, mu=mu: (y[1], -pull - mu * G * math.tanh(100.0 * y[1])), (t, 1.0), (x, v),
            events=there, rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        t, (x, v) = part.t[-1], part.y[:, -1]
        found.append(t)
    assert found[0] < 0.2 < found[1] < 0.95
    trace = run(scene, start, 1.0, method, accuracy)
    assert trace.q[-1, 0] == pytest.approx(x, rel=0, abs=2.0 * accuracy)


def test_feet_that_stand_on_the_edges_of_patches() -> None:
    """Middle feet on an edge, which soft ground on either side drives to the other.

    Two methods agree, a cut run has the bits of a whole one, and switches do not pile up: without
    a width of an edge there are thousands.
    """
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
    for cut in (0.01, 0.05):  # s, within what the feet do at first
        first = walk(cut, method="dop853", accuracy=1e-8)
        rest = walk(0.2 - cut, method="dop853", accuracy=1e-8, initial=first.checkpoint)
        np.testing.assert_array_equal(rest.q[-1], truth.q[-1])


def shaken(t0: float, z0: float, v0: float, rate: float, ground: tuple[float, float]) -> Motion:
    """Height and speed of 1 kg on a spring `rate`^2 under gravity, on shaken ground, from t0."""
    amplitude, w = ground
    forced, mean = amplitude * rate**2 / (rate**2 - w**2), -G / rate**2
    a = z0 - mean - forced * math.sin(w * t0)
    b = (v0 - forced * w * math.cos(w * t0)) / rate

    def at(t: float) -> tuple[float, float]:
        s, c = math.sin(rate * (t - t0)), math.cos(rate * (t - t0))
        place = mean + forced * math.sin(w * t) + a * c + b * s
        return place, forced * w * math.cos(w * t) + rate * (b * c - a * s)

    return at


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("height", "accuracy"), [(0.02, 1e-7), (0.05, 5e-8)])
def test_a_mass_meets_ground_that_shakes(method: str, height: float, accuracy: float) -> None:
    """Fall, contact on a linear spring and flight again, each in closed form.

    The force has a kink at both ends: a step over one of them is wrong by several accuracies.
    """
    stiffness, ground = 1e5, (1e-3, 2.0 * math.pi * 30.0)
    rate = math.sqrt(stiffness)

    def surface(t: float) -> float:
        return ground[0] * math.sin(ground[1] * t)

    def first(gap: Callable[[float], float], begin: float) -> float:
        times = begin + np.arange(1, 10_000) * 2e-5
        k = int(np.argmax(np.array([gap(t) for t in times]) < 0.0))
        return brentq(gap, times[k - 1], times[k], xtol=1e-15)

    touch = first(lambda t: height - 0.5 * G * t**2 - surface(t), 0.0)
    on = shaken(touch, surface(touch), -G * touch, rate, ground)
    leave = first(lambda t: surface(t) - on(t)[0], touch)
    z, v = on(leave)
    end = round(leave + 0.01, 2)
    expected = z + v * (end - leave) - 0.5 * G * (end - leave) ** 2
    robot = bodies.particle()
    scene = bodies.on_ground(
        robot, hp.contact.KelvinVoigt(stiffness=stiffness, damping=0.0, exponent=1.0),
        terrain=hp.terrain.ShakingGround(ground=hp.Flat(), amplitude=ground[0], frequency=30.0),
    )  # fmt: skip
    trace = run(scene, bodies.state(robot, (0.0, 0.0, height)), end, method, accuracy)
    assert trace.q[-1, 2] == pytest.approx(expected, rel=0, abs=accuracy)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
def test_a_mass_leaves_where_its_damper_would_pull(method: str, accuracy: float) -> None:
    """On a spring and a damper until K d + c d' = 0, with depth left; then it flies.

    A step over that place is wrong at every accuracy: the force has a kink there.
    """
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


def lift_off(stiffness: float, damping: float, ramp: float, speed: float) -> tuple[float, float]:
    """Duration [s] of an impact of 1 kg by AdamsImpact, and the speed that it leaves with [m/s]."""

    def change(_: float, y: np.ndarray) -> list[float]:
        depth, rate = y
        share = min(max(depth, 0.0) / ramp, 1.0)
        force = stiffness * max(depth, 0.0) ** 1.5 + damping * share**2 * (3 - 2 * share) * rate
        return [rate, G - max(0.0, force)]

    def out(_: float, y: np.ndarray) -> float:
        return y[0]

    out.terminal, out.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        change, (0.0, 1.0), [1e-18, speed], method="DOP853", events=out, rtol=1e-13, atol=1e-16,
        max_step=2e-7,
    )  # fmt: skip
    return float(found.t[-1]), float(-found.y[1, -1])


@pytest.mark.parametrize(
    ("method", "accuracy", "drop"),
    [("extrapolated-euler", 1e-8, 0.02), ("ndf", 1e-10, 0.025), ("dop853", 1e-10, 0.02)],
)
def test_a_mass_presses_once_more_before_it_leaves_where_its_damper_fades(method, accuracy, drop):
    """The damper of AdamsImpact would pull with depth left; just below the surface the spring wins.

    A step that is long beside that depth must not pass over the last push.
    """
    stiffness, damping, ramp = 4e8, 2500.0, 5e-5
    touch = math.sqrt(2.0 * drop / G)
    contact, speed = lift_off(stiffness, damping, ramp, G * touch)
    end = round(touch + contact + 0.02, 3)
    law = hp.contact.AdamsImpact(
        stiffness=stiffness, exponent=1.5, damping=damping, damping_depth=ramp
    )
    robot = bodies.particle()
    trace = hp.simulate(
        bodies.on_ground(robot, law), hp.HoldPosture(), duration=end, sample=end, method=method,
        initial=bodies.state(robot, (0.0, 0.0, drop)), accuracy=accuracy, estimate=False,
    )  # fmt: skip
    left = end - touch - contact
    expected = speed * left - 0.5 * G * left**2
    assert trace.q[-1, 2] == pytest.approx(expected, rel=0, abs=accuracy)


@pytest.mark.parametrize("drop", [0.05, 0.2])
def test_no_accuracy_is_too_tight_for_the_force_that_jumps_at_touch_down(drop: float) -> None:
    """Its c d' acts at once: however short, a step of an implicit method across it is not accurate.

    The mass comes to rest: c is 300 of the 126 N s/m from which on it does not bounce.
    """
    stiffness, damping = 4000.0, 300.0
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


FLAPS = """<robot name="flaps">
<link name="base"><inertial><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0"
 ixz="0" iyz="0"/></inertial></link>
<link name="flap"><inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0"
 ixz="0" iyz="0"/></inertial></link>
<link name="foot"/>
<joint name="hinge" type="revolute"><parent link="base"/><child link="flap"/><axis xyz="0 0 1"/>
<limit lower="-0.5" upper="0.5" effort="10" velocity="100"/></joint>
<joint name="fix" type="fixed"><parent link="base"/><child link="foot"/></joint></robot>"""


@pytest.mark.parametrize("method", METHODS)
def test_a_flap_bounces_between_its_stops(method: str, tmp_path: Path) -> None:
    """Two bodies about one axis: at a stop half a swing of sqrt(K/I), I = I1 I2/(I1 + I2)."""
    path = tmp_path / "flaps.urdf"
    path.write_text(FLAPS)
    robot = hp.load_robot(path, feet=["foot"])
    stiffness, speed, accuracy, end = 500.0, 5.0, 1e-7, 2.0
    scene = hp.Scene(
        robot, servo=LIMP, stops=hp.JointStops(stiffness=stiffness), gravity=(0.0, 0.0, 0.0)
    )
    v = np.zeros(7)
    v[6] = speed
    q = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    trace = run(scene, robot.check_state(q, v), end, method, accuracy)
    rate = math.sqrt(stiffness / (0.02 * 0.01 / 0.03))
    rest, at_stop = 1.0 / speed, math.pi / rate
    phase = (end - 0.5 / speed) % (2.0 * (rest + at_stop))  # from the upper stop on
    back = phase - (rest + at_stop)
    side, since = (1.0, phase) if back < 0.0 else (-1.0, back)
    depth = speed / rate * math.sin(rate * since) if since < at_stop else speed * (at_stop - since)
    # errors of velocity stay, and ten bounces add them up
    assert trace.q[-1, 7] == pytest.approx(side * (0.5 + depth), rel=0, abs=100 * accuracy)


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "robust"])
def test_sampled_forces_never_pull_nor_leave_the_cone(method: str) -> None:
    """In a dropped robot on bristles; and what the ground gives is the change of momentum."""
    import pinocchio as pin

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
    data = robot.model.createData()

    def momentum(k: int) -> np.ndarray:
        pin.centerOfMass(robot.model, data, trace.q[k], trace.v[k])
        return robot.total_mass * data.vcom[0]

    gravity = np.array([0.0, 0.0, -G]) * robot.total_mass * trace.time[-1]
    change = momentum(-1) - momentum(0)
    # robust steps leave the terms of second order in the joints' turning
    allowed = 0.02 if method == "robust" else 1e-4
    assert trace.foot_impulse.sum(axis=(0, 1)) + gravity == pytest.approx(change, abs=allowed)

"""Hard cases on ground that is not flat or not at rest, through the simulator's front door."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from vehicles import HARD_CASES

import hexapod_pin as hp

G = 9.81
NO_FRICTION = hp.TanhCoulomb(mu=0.0, slope=1.0)


def ball(tmp_path: Path, radius: float, m: float = 1.0, inertia: float = 0.01) -> hp.Robot:
    """A rigid body whose single foot is a sphere about its centre of mass."""
    vehicles.block(tmp_path, {"foot": (0.0, 0.0, 0.0)}, m=m, inertia=(inertia,) * 3)
    return hp.load_robot(tmp_path / "block.urdf", feet=["foot"], foot_radius=radius)


def scene(robot: hp.Robot, terrain, normal, friction=NO_FRICTION) -> hp.Scene:
    contact = hp.Contact(normal=normal, friction=friction)
    return hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP)


def at(robot: hp.Robot, place: np.ndarray, velocity: np.ndarray) -> hp.State:
    """A level state with its centre at `place`, world axes."""
    q, v = pin.neutral(robot.model), np.zeros(robot.model.nv)
    q[:3], v[:3] = place, velocity
    return robot.check_state(q, v)


def downhill(heading: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors down a slope that falls along `heading`, across it (left), and out of it."""
    turn = pin.rpy.rpyToMatrix(0.0, angle, heading)
    return turn[:, 0], turn[:, 1], turn[:, 2]


# --- HC10 ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, 2.2])
def test_hc10_slide_across_a_slope(heading: float, tmp_path: Path) -> None:
    """HC10: a particle thrown across a real slope, whatever way it faces; state at 1 s."""
    angle = math.atan(0.3)
    down, across, out = downhill(heading, angle)
    normal = hp.HuntCrossley(stiffness=1e6)
    depth = (G * math.cos(angle) / normal.stiffness) ** (2.0 / 3.0)
    robot = vehicles.particle(tmp_path)
    slope = hp.Slope(angle=-angle, heading=heading)
    trace = hp.simulate(
        scene(robot, slope, normal, hp.TanhCoulomb(mu=0.5, slope=1000.0)),
        hp.HoldPosture(),
        duration=1.0,
        method="rk4",
        step=2e-5,
        sample=0.5,
        initial=at(robot, -depth * out, across),
    )
    reference = HARD_CASES["HC10_slope_lateral"]["ref"]
    moved = trace.q[-1, :3] - trace.q[0, :3]
    assert moved @ down == pytest.approx(reference["x"], rel=1e-7)
    assert moved @ across == pytest.approx(reference["y"], rel=1e-7)
    assert moved @ out == pytest.approx(0.0, abs=1e-12)
    assert trace.v[-1, :3] @ down == pytest.approx(reference["vx"], rel=1e-7)


# --- HC25 ---------------------------------------------------------------------------------------


def shaken_table(tmp_path: Path, normal, depth: float) -> hp.Trace:
    """A particle that starts with the table, at its static depth; sampled at every step."""
    robot, amplitude, frequency = vehicles.particle(tmp_path), 2e-3, 12.0
    rate = 2.0 * math.pi * frequency
    return hp.simulate(
        scene(robot, hp.ShakingGround(amplitude=amplitude, frequency=frequency), normal),
        hp.HoldPosture(),
        duration=0.045,
        method="rk4",
        step=5e-6,
        sample=5e-6,
        initial=vehicles.state(robot, -depth, (0.0, 0.0, amplitude * rate)),
    )


def flight(trace: hp.Trace) -> tuple[float, float, int]:
    """Return when the force first ends, when it comes back [s], and the sample before that."""
    pressed = trace.foot_force[:, 0, 2] > 0.0
    off = int(np.argmax(~pressed))
    on = off + int(np.argmax(pressed[off:]))
    return float(trace.time[off]), float(trace.time[on]), on - 1


@pytest.mark.parametrize(("stiffness", "damping"), [(1e8, 2e3), (1e10, 2e4)])
def test_hc25_shaken_table_linear_spring(stiffness: float, damping: float, tmp_path: Path) -> None:
    """HC25: take-off and landing of the rigid limit within 2e-4 s, the speed within 0.2 %."""
    normal = hp.KelvinVoigt(stiffness=stiffness, exponent=1.0, damping=damping)
    trace = shaken_table(tmp_path, normal, G / stiffness)
    reference = HARD_CASES["HC25_shaken_table"]["ref"]
    off, on, before = flight(trace)
    assert off == pytest.approx(float(reference["t_takeoff"]), abs=2e-4)
    assert on == pytest.approx(float(reference["t_landing"]), abs=2e-4)
    rate = 2.0 * math.pi * 12.0
    closing = 2e-3 * rate * math.cos(rate * trace.time[before]) - trace.v[before, 2]
    # the speed grows by g + A w^2 within a step of 5 us: 1e-4 m/s
    assert closing == pytest.approx(float(reference["impact_speed"]), abs=1e-4)


def test_hc25_shaken_table_converges_with_hertz_stiffness(tmp_path: Path) -> None:
    """HC25: Hertz contact lets go late, by less the stiffer it is.

    Its stiffness vanishes with the force, so K = 1e8 N/m^1.5 is 3e-4 s late; the lag falls as
    K^(-2/7) (inertia against d ~ F^(2/3)), to below 2e-4 s at 1e12.
    """
    reference = HARD_CASES["HC25_shaken_table"]["ref"]
    late = []
    for stiffness in (1e9, 1e12):
        normal = hp.HuntCrossley(stiffness=stiffness, dissipation=100.0)
        trace = shaken_table(tmp_path, normal, (G / stiffness) ** (2.0 / 3.0))
        off, on, _ = flight(trace)
        late.append(abs(off - float(reference["t_takeoff"])))
        late.append(abs(on - float(reference["t_landing"])))
    assert late[2] < 2e-4 and late[3] < 2e-4
    assert late[2] < 0.5 * late[0] and late[3] < 0.5 * late[1]


# --- HC27 ---------------------------------------------------------------------------------------

RADIUS, SHELF = 0.02, 0.1
STIFF = hp.KelvinVoigt(stiffness=1e10, exponent=1.0, damping=5e3)  # 1 nm under the particle


def over_the_edge(tmp_path: Path, speed: float, duration: float, heading: float = 0.0) -> hp.Trace:
    """A sphere that slides off a shelf without friction, its centre at the edge at t = 0."""
    robot = ball(tmp_path, RADIUS)
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    top = np.array([0.0, 0.0, SHELF + RADIUS - G / STIFF.stiffness])
    ledge = hp.Ledge(height=SHELF, heading=heading)
    return hp.simulate(
        scene(robot, ledge, STIFF),
        hp.HoldPosture(),
        duration=duration,
        method="rk4",
        step=5e-6,
        sample=1e-5,
        initial=at(robot, top - 1e-3 * along, speed * along),
    )


def mechanical(trace: hp.Trace) -> np.ndarray:
    return trace.energy["kinetic"] + trace.energy["potential"] + trace.energy["elastic"]


def test_hc27_ledge_fast(tmp_path: Path) -> None:
    """HC27: at 0.5 m/s it leaves at once and its centre reaches the radius at x = 71.39 mm."""
    trace = over_the_edge(tmp_path, 0.5, 0.144)
    z, v = trace.q[-1, 2], trace.v[-1, :3]
    left = (v[2] + math.sqrt(v[2] ** 2 + 2.0 * G * (z - RADIUS))) / G  # a parabola from here
    expected = float(HARD_CASES["HC27_ledge"]["ref"]["v=0.5: centre x when centre is at z=r"])
    assert trace.q[-1, 0] + left * v[0] == pytest.approx(expected, rel=1e-4)
    assert trace.foot_force[trace.q[:, 0] > 2e-5].max() == 0.0
    assert np.ptp(trace.q[:, 1]) == 0.0


def parting_cosine(trace: hp.Trace, heading: float = 0.0) -> float:
    """Cosine of the angle at which the sphere parts from the edge: N = 0 of N(cos), a line."""
    along = trace.q[:, 0] * math.cos(heading) + trace.q[:, 1] * math.sin(heading)
    angle = np.arctan2(along, trace.q[:, 2] - SHELF)
    cosine = np.cos(0.5 * (angle[1:] + angle[:-1]))  # a sampled force is the mean since the last
    force = np.linalg.norm(trace.foot_force[1:, 0], axis=1)
    late = (force > 0.05) & (force < 0.5) & (along[1:] > 1e-3)
    assert late.sum() > 50
    # N = m (g (3 cos - 2) - v^2/r) is linear in cos: its zero is where they part
    slope, offset = np.polyfit(cosine[late], force[late], 1)
    assert slope == pytest.approx(3.0 * G, rel=2e-3)  # the damper's lag
    return float(-offset / slope)


@pytest.mark.parametrize(("speed", "heading"), [(0.2, 0.0), (0.2, 2.5), (0.4, 0.0)])
def test_hc27_ledge_slow(speed: float, heading: float, tmp_path: Path) -> None:
    """HC27: slower, it rolls about the edge and parts where cos = 2/3 + v^2/(3 g r)."""
    trace = over_the_edge(tmp_path, speed, 0.1, heading)
    parted = math.acos(parting_cosine(trace, heading))
    exact = math.acos(2.0 / 3.0 + speed**2 / (3.0 * G * RADIUS))
    if speed == 0.2:
        key = "v=0.2: separation angle from vertical"
        [named] = [v for k, v in HARD_CASES["HC27_ledge"]["ref"].items() if k.startswith(key)]
        assert math.degrees(exact) == pytest.approx(float(named), rel=1e-9)
    assert parted == pytest.approx(exact, rel=1e-4)


def test_hc27_speed_that_leaves_at_once(tmp_path: Path) -> None:
    """HC27: sqrt(g r) = 0.443 m/s divides leaving at once from rolling about the edge."""
    limit = float(HARD_CASES["HC27_ledge"]["ref"]["v_min_immediate_leave=sqrt(g r)"])
    assert limit == pytest.approx(math.sqrt(G * RADIUS), rel=1e-12)
    for factor, nearest, farthest in ((1.01, 0.0, 1e-4), (0.99, 1e-3, RADIUS)):
        trace = over_the_edge(tmp_path, factor * limit, 0.02)
        pressed = np.linalg.norm(trace.foot_force[:, 0], axis=1) > 0.0
        # below the limit 2 % of the weight is left at the edge, and rolls on to 2.3 mm
        assert nearest < trace.q[pressed, 0].max() < farthest


def test_hc27_parting_angles_lead_to_the_speed_that_leaves_at_once(tmp_path: Path) -> None:
    """HC27: cos is a line in v^2; it reaches 1, no rolling at all, at sqrt(g r), to 1e-4.

    Seen directly the limit is blurred to some 0.3 %: the spring's last nanometre lifts the ball.
    """
    speeds = np.array([0.2, 0.25, 0.3, 0.35, 0.4])
    cosines = [parting_cosine(over_the_edge(tmp_path, v, 0.1)) for v in speeds]
    slope, offset = np.polyfit(speeds**2, cosines, 1)
    limit = float(HARD_CASES["HC27_ledge"]["ref"]["v_min_immediate_leave=sqrt(g r)"])
    assert math.sqrt((1.0 - offset) / slope) == pytest.approx(limit, rel=1e-4)


@pytest.mark.parametrize("speed", [0.2, 0.44, 0.5])
def test_hc27_no_kick(speed: float, tmp_path: Path) -> None:
    """HC27: no energy comes from the edge, and what the damper takes is accounted for."""
    trace = over_the_edge(tmp_path, speed, 0.09)
    energy = mechanical(trace)
    assert (energy - energy[0]).max() < 1e-12  # asked for: 1e-6 J
    assert np.abs(trace.energy_residual).max() < 1e-8
    assert np.abs(trace.v[:, 1]).max() == 0.0


# --- HC28 ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, 0.9])
@pytest.mark.parametrize(("left", "right"), [(45.0, 45.0), (30.0, 60.0)])
def test_hc28_v_groove(left: float, right: float, heading: float, tmp_path: Path) -> None:
    """HC28: a sphere of 1 N presses on both faces of a V groove as statics say."""
    faces = np.radians([left, right])
    groove = hp.Groove(angle_left=faces[0], angle_right=faces[1], depth=0.1, heading=heading)
    robot = ball(tmp_path, RADIUS, m=1.0 / G)
    normal = hp.HuntCrossley(stiffness=1e6, dissipation=50.0)
    start = groove.lift([[0.0, 0.0, 0.0]], RADIUS)
    trace = hp.simulate(
        scene(robot, groove, normal),
        hp.HoldPosture(),
        duration=3.0,
        sample=3.0,
        initial=vehicles.state(robot, start),
    )
    assert trace.foot_force[-1, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    touched = groove.native().contacts(trace.q[-1, :3], RADIUS)
    assert len(touched) == 2
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    forces = {
        round(math.degrees(math.asin(float(n @ along)))): float(normal.force(-gap))
        for gap, n in touched
    }
    reference = HARD_CASES["HC28_v_groove"]["ref"]
    if left == right:
        both = pytest.approx(float(reference["N45_each"]), rel=1e-6)
        assert forces == {45: both, -45: both}
    else:
        flat = pytest.approx(float(reference["N_on_30deg_face"]), rel=1e-6)
        assert forces == {30: flat, -60: pytest.approx(0.5, rel=1e-6)}


# --- HC30 ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, -1.3])
def test_hc30_rolling_sphere(heading: float, tmp_path: Path) -> None:
    """HC30: a solid sphere rolls down 15 degrees: steady slip of the tanh law, 5/7 g sin."""
    radius, angle = 0.05, math.radians(15.0)
    robot = ball(tmp_path, radius, inertia=0.4 * radius**2)
    normal = hp.HuntCrossley(stiffness=1e6)
    depth = (G * math.cos(angle) / normal.stiffness) ** (2.0 / 3.0)
    down, across, out = downhill(heading, angle)
    slope = hp.Slope(angle=-angle, heading=heading)
    trace = hp.simulate(
        scene(robot, slope, normal, hp.TanhCoulomb(mu=0.5, slope=1000.0)),
        hp.HoldPosture(),
        duration=0.4,
        method="rk4",
        step=1e-5,  # slip decays at 3.5 mu g kt cos = 1.7e4 1/s
        sample=0.1,
        initial=at(robot, (radius - depth) * out, np.zeros(3)),
    )
    turn = [pin.Quaternion(q[3:7]).matrix() for q in trace.q]
    speed = np.array([r @ v[:3] @ down for r, v in zip(turn, trace.v, strict=True)])
    spin = np.array([r @ v[3:6] @ across for r, v in zip(turn, trace.v, strict=True)])
    reference = HARD_CASES["HC30_rolling_sphere"]["ref"]
    slip = float(reference["slip_speed_steady=atanh(2 tan/(7 mu))/k"])
    assert speed[-1] - radius * spin[-1] == pytest.approx(slip, rel=1e-6)
    gain = (speed[-1] - speed[1]) / (trace.time[-1] - trace.time[1])
    assert gain == pytest.approx(float(reference["accel=5/7 g sin"]), rel=1e-6)
    assert (trace.q[-1, :3] - trace.q[0, :3]) @ across == pytest.approx(0.0, abs=1e-12)

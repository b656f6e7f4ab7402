"""Contact laws against the hard-case catalogue, through the simulator's front door."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import vehicles
from vehicles import HARD_CASES

import hexapod_pin as hp

G = 9.81
SMOOTH = hp.TanhCoulomb(mu=0.0, slope=1.0)
TANH = hp.TanhCoulomb(mu=0.5, slope=1000.0)
FRICTION = {
    "tanh": TANH,
    "adams": hp.Contact.s2().friction,
    "smooth-step": hp.SmoothStep(mu_static=0.5, mu_dynamic=0.4, speed=5e-3),
    "brown-mcphee": hp.BrownMcPhee(mu_static=0.5, mu_dynamic=0.4, speed=5e-3),
    "stick-slip": hp.StickSlip(mu=0.5, mu_dynamic=0.4, stiffness=2e4, damping=2e3),
}


def strike(
    folder: Path, law: hp.NormalLaw, *, mass: float, speed: float, step: float, steps: int,
    gap: float = 0.0, gravity: float = 0.0,
) -> hp.Trace:  # fmt: skip
    """A particle that arrives with `speed` at a ground `gap` below it; RK4, every step kept."""
    robot = vehicles.particle(folder, mass)
    contact = hp.Contact(normal=law, friction=SMOOTH)
    scene = hp.Scene(robot, contact=contact, servo=vehicles.LIMP, gravity=(0, 0, -gravity))
    start = vehicles.state(robot, gap, (0.0, 0.0, -speed))
    duration = step * steps
    return hp.simulate(
        scene,
        hp.HoldPosture(),
        duration=duration,
        method="rk4",
        step=step,
        sample=step,
        initial=start,
    )


def top(samples: np.ndarray) -> float:
    """Largest value of a smooth curve: parabola through the largest sample and its neighbours."""
    i = int(samples.argmax())
    before, at, after = samples[i - 1 : i + 2]
    return float(at - (before - after) ** 2 / (8.0 * (before - 2.0 * at + after)))


@pytest.mark.parametrize("gap", [0.0, 0.37], ids=["at touch", "from the air"])
@pytest.mark.parametrize("case", HARD_CASES["HC01b_impact_detail"]["ref"])
def test_hc01b_impact_detail(case: str, gap: float, tmp_path: Path) -> None:
    """HC01b: restitution, depth, duration and peak of one impact, six laws, 1e-7.

    Also when touch-down falls inside a step: the core has kept the approach speed.
    """
    expected = {k: float(x) for k, x in HARD_CASES["HC01b_impact_detail"]["ref"][case].items()}
    exponent, asked = (float(part.split("=")[1]) for part in case.split(","))
    law = hp.Restitution(
        stiffness=1e6, exponent=exponent, restitution=asked, model="lankarani-nikravesh"
    )
    step = float(f"{expected['tc'] / 4000:.3g}")
    trace = strike(tmp_path, law, mass=0.5, speed=1.0, step=step, steps=4400, gap=gap * step)
    depth, rebound = -trace.foot_gap[:, 0], trace.v[-1, 2]
    # without gravity the rebound is straight: its start follows from any later sample
    left = trace.time[-1] - trace.q[-1, 2] / rebound - gap * step
    assert rebound == pytest.approx(expected["e"], rel=1e-7)
    assert top(depth) == pytest.approx(expected["dmax"], rel=1e-7)
    assert left == pytest.approx(expected["tc"], rel=1e-7)
    force = law.force(depth, -trace.v[:, 2], 1.0)
    assert top(force) == pytest.approx(expected["Fpeak"], rel=1e-7)
    # the recorded force is a mean over each step: h^2 F''/24 lower at the peak, at 4000 steps 2e-7
    assert top(trace.foot_force[:, 0, 2]) == pytest.approx(expected["Fpeak"], rel=3e-7)


@pytest.mark.parametrize("asked", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("model", ["exact", "flores", "hunt-crossley", "gonthier"])
def test_hc01_simulated_restitution(model: str, asked: float, tmp_path: Path) -> None:
    """HC01: the simulated rebound is the closed form's, 1e-7; the exact root's, what was asked."""
    law = hp.Restitution(stiffness=1e6, restitution=asked, model=model)
    # strong damping leaves slowly: about depth/(e v) after the deepest point
    trace = strike(tmp_path, law, mass=0.5, speed=0.2, step=1e-5, steps=12000, gap=3.3e-6)
    assert trace.foot_gap[-1, 0] > 0.0
    assert trace.v[-1, 2] / 0.2 == pytest.approx(law.delivered, rel=1e-7)
    if model == "exact":
        assert trace.v[-1, 2] / 0.2 == pytest.approx(asked, rel=1e-7)


@pytest.mark.parametrize("zeta", HARD_CASES["HC01c_linear_kelvin_voigt"]["ref"])
def test_hc01c_kelvin_voigt(zeta: str, tmp_path: Path) -> None:
    """HC01c: no tension at separation; the force jumps to 2 zeta m v0 w0 at touch-down.

    The particle starts 1e-14 m deep, for a fixed step that meets the jump in its middle is of
    order 1 whatever the method.
    """
    expected = HARD_CASES["HC01c_linear_kelvin_voigt"]["ref"][zeta]
    stiffness, mass = 1e4, 0.5
    rate = math.sqrt(stiffness / mass)
    law = hp.KelvinVoigt(stiffness=stiffness, damping=2.0 * float(zeta) * mass * rate)
    step = float(f"{0.8e-3 / rate:.3g}")
    trace = strike(tmp_path, law, mass=mass, speed=1.0, step=step, steps=6000, gap=-1e-14)
    assert trace.v[-1, 2] == pytest.approx(float(expected["e_no_tension"]), rel=1e-7)
    assert (trace.foot_force[:, 0, 2] >= 0.0).all()
    jump = trace.foot_force[0, 0, 2] / (mass * rate)
    assert jump == pytest.approx(float(expected["initial_force_jump_over_m_v0_omega0"]), rel=1e-7)


@pytest.mark.parametrize("case", HARD_CASES["HC01d_adams_impact_seed2"]["ref"])
def test_hc01d_adams_impact(case: str, tmp_path: Path) -> None:
    """HC01d: restitution and depth of ADAMS IMPACT with S2's numbers, 1e-6."""
    expected = HARD_CASES["HC01d_adams_impact_seed2"]["ref"][case]
    mass, speed = (float(part.split("=")[1].rstrip("mkgs/")) for part in case.split(","))
    speed *= 1e-3
    trace = strike(
        tmp_path, hp.Contact.s2().normal, mass=mass, speed=speed, step=1e-6, steps=4200, gap=1e-9
    )
    assert trace.v[-1, 2] / speed == pytest.approx(expected["e"], rel=1e-6)
    assert top(-trace.foot_gap[:, 0]) * 1e3 == pytest.approx(expected["delta_max_mm"], rel=1e-6)


def test_hc03_rings_at_a_rate_that_no_stiffness_changes(tmp_path: Path) -> None:
    """HC03: static depth to 1e-9; w = sqrt(1.5 g/d) and decay 0.75 a g of the ringing to 1e-3."""
    expected = HARD_CASES["HC03_zeno_and_settling"]["ref"]
    static = float(expected["delta_static"])
    law = hp.HuntCrossley(stiffness=1e6, dissipation=0.2)
    trace = strike(
        tmp_path, law, mass=0.5, speed=0.0, step=2e-4, steps=75000, gap=-1.001 * static, gravity=G
    )
    assert -trace.foot_gap[-1, 0] == pytest.approx(static, rel=1e-9)  # 15 s: exp(-22) of 1e-3 left
    ringing = trace.time < 3.0
    x, v = -trace.foot_gap[ringing, 0] - static, -trace.v[ringing, 2]
    time, rate = trace.time[ringing], float(expected["omega_n=sqrt(1.5 g/delta_s)"])
    phase = np.unwrap(np.arctan2(-v / rate, x))
    decay = -np.polyfit(time, np.log(np.hypot(x, v / rate)), 1)[0]
    assert decay == pytest.approx(float(expected["decay_rate=0.75*a*g"]), rel=1e-3)
    assert np.polyfit(time, phase, 1)[0] == pytest.approx(rate, rel=1e-4)  # (decay/w)^2/2 = 2e-5


@pytest.mark.parametrize("case", HARD_CASES["HC04_elastic_bounce_stiffness_sweep"]["ref"])
def test_hc04_one_elastic_bounce(case: str, tmp_path: Path) -> None:
    """HC04: depth, peak and duration of the contact for all fourteen stiffnesses, and its energy.

    From touch-down at the fall's speed, under gravity: 1e-6.
    """
    sweep = HARD_CASES["HC04_elastic_bounce_stiffness_sweep"]
    expected = {k: float(x) for k, x in sweep["ref"][case].items()}
    stiffness, exponent = (float(part.split("=")[1]) for part in case.split(","))
    law = hp.HuntCrossley(stiffness=stiffness, exponent=exponent)
    speed, step = float(sweep["v_impact"]), float(f"{expected['t_contact'] / 4000:.3g}")
    trace = strike(tmp_path, law, mass=0.5, speed=speed, step=step, steps=4200, gravity=G)
    depth, rebound = -trace.foot_gap[:, 0], trace.v[-1, 2]
    assert top(depth) == pytest.approx(expected["delta_max"], rel=1e-6)
    assert top(law.force(depth)) == pytest.approx(expected["F_peak"], rel=1e-6)
    height = trace.q[-1, 2] + rebound**2 / (2.0 * G)
    assert height == pytest.approx(0.1, rel=1e-6)
    left = trace.time[-1] - (math.sqrt(2.0 * G * height) - rebound) / G
    assert left == pytest.approx(expected["t_contact"], rel=1e-6)


@pytest.mark.parametrize(
    ("case", "step", "bounces"),
    [
        ("K=1e3,n=1.5", 5e-5, 30),
        ("K=1e5,n=1", 5e-6, 10),
        ("K=1e6,n=1.5", 2e-5, 100),
        ("K=1e9,n=1.5", 1e-6, 2),
    ],
)
def test_hc04_elastic_bounces(case: str, step: float, bounces: int, tmp_path: Path) -> None:
    """HC04: energy and apex height to 1e-6, time of the last apex to 1e-7 of the run.

    The catalogue's 100 bounces are run for K = 1e6, n = 1.5 (1.5 million steps, 3 s); fewer for the
    others, whose steps must be smaller at a kink (n = 1) or a short contact.
    """
    expected = HARD_CASES["HC04_elastic_bounce_stiffness_sweep"]["ref"][case]
    stiffness, exponent = (float(part.split("=")[1]) for part in case.split(","))
    contact = hp.Contact(
        normal=hp.HuntCrossley(stiffness=stiffness, exponent=exponent), friction=SMOOTH
    )
    robot = vehicles.particle(tmp_path, 0.5)
    end = bounces * float(expected["period"])
    trace = hp.simulate(
        hp.Scene(robot, contact=contact, servo=vehicles.LIMP),
        hp.HoldPosture(),
        duration=round(end, 3) + 1e-3,
        method="rk4",
        step=step,
        sample=1e-3,
        initial=vehicles.state(robot, 0.1),
    )
    energy = sum(trace.energy[name] for name in ("kinetic", "potential", "elastic"))
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-6
    late = int(np.argmin(np.abs(trace.time - end)))  # in flight, near the apex
    assert trace.q[late, 2] + trace.v[late, 2] ** 2 / (2.0 * G) == pytest.approx(0.1, rel=1e-6)
    assert trace.time[late] + trace.v[late, 2] / G == pytest.approx(end, rel=1e-7)


def on_slope(
    folder: Path, friction: hp.FrictionLaw, tangent: float, normal: hp.NormalLaw | None = None
) -> tuple[hp.Scene, hp.State]:
    """A particle of 1 kg at its static depth on a slope (tilted gravity; x downhill)."""
    robot = vehicles.particle(folder)
    cosine = 1.0 / math.hypot(1.0, tangent)
    law = normal or hp.HuntCrossley(stiffness=1e6)
    scene = hp.Scene(
        robot,
        contact=hp.Contact(normal=law, friction=friction),
        servo=vehicles.LIMP,
        gravity=(G * tangent * cosine, 0.0, -G * cosine),
    )
    depth = (G * cosine / law.stiffness) ** (1.0 / law.exponent)
    return scene, vehicles.state(robot, -depth)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("name", FRICTION)
def test_hc06_creep_of_every_friction_law(name: str, share: float, tmp_path: Path) -> None:
    """HC06: on a slope below the friction angle each law creeps at the speed it documents.

    The slope comes at once: a bristle damped less would overshoot its load, reach the cone at a
    share of 0.95, and slide on at its dynamic coefficient.
    """
    law = FRICTION[name]
    tangent = share * law.limit
    scene, start = on_slope(tmp_path, law, tangent)
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=10.0, step=1e-3, sample=1.0, initial=start
    )
    if name == "stick-slip":
        assert np.abs(trace.v[-1, :2]).max() < 1e-12
        stretch = tangent * G / math.hypot(1.0, tangent) / law.stiffness
        assert trace.q[-1, 0] == pytest.approx(stretch, rel=1e-6)  # its load over k, and no more
    else:
        assert trace.v[-1, 0] == pytest.approx(law.creep_speed(tangent), rel=1e-6)
    assert abs(trace.v[-1, 1]) < 1e-15


@pytest.mark.parametrize("name", FRICTION)
def test_hc06_above_the_friction_angle_every_law_slides_away(name: str, tmp_path: Path) -> None:
    """Just above the limit it accelerates by g cos (tan - m), m between its least and its limit."""
    law = FRICTION[name]
    tangent = 1.05 * law.limit
    scene, start = on_slope(tmp_path, law, tangent)
    trace = hp.simulate(scene, hp.HoldPosture(), duration=2.0, sample=0.5, initial=start)
    pull = G / math.hypot(1.0, tangent)
    gained = np.diff(trace.v[1:, 0]) / 0.5  # without the start-up
    passed = np.linspace(trace.v[1, 0], trace.v[-1, 0], 100)
    least, most = tangent - law.limit, tangent - float(law.coefficient(passed).min())
    assert (gained >= pull * least * (1 - 1e-9)).all()
    assert (gained <= pull * most * (1 + 1e-9)).all()


def test_hc10_across_a_slope(tmp_path: Path) -> None:
    """HC10: 1 m/s across tan = 0.3: path and speed after 1 s; friction is isotropic, 1e-7."""
    case = HARD_CASES["HC10_slope_lateral"]["ref"]
    scene, start = on_slope(tmp_path, TANH, 0.3)
    start = vehicles.state(scene.robot, start.q[2], (0.0, 1.0, 0.0))
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=1.0, method="rk4", step=2e-5, sample=1.0, initial=start
    )
    assert trace.q[-1, 0] == pytest.approx(case["x"], rel=1e-7)
    assert trace.q[-1, 1] == pytest.approx(case["y"], rel=1e-7)
    assert trace.v[-1, 0] == pytest.approx(case["vx"], rel=1e-7)
    assert abs(trace.v[-1, 1]) < 1e-12


GRAZING = {
    "elastic": hp.HuntCrossley(stiffness=1e6),
    "hunt-crossley": hp.HuntCrossley(stiffness=1e6, dissipation=20.0),
    "lankarani-nikravesh": hp.Restitution(
        stiffness=1e6, restitution=0.3, model="lankarani-nikravesh"
    ),
    "exact": hp.Restitution(stiffness=1e6, restitution=0.3),
    "adams": hp.Contact.s2().normal,
}


@pytest.mark.parametrize("lowest", [1e-12, 0.0, -1e-12, -1e-9])
@pytest.mark.parametrize("method", ["rk4", "implicit-euler"])
@pytest.mark.parametrize("name", GRAZING)
def test_hc24_grazing(name: str, method: str, lowest: float, tmp_path: Path) -> None:
    """HC24: a foot that just touches, or just does not, flies on as if nothing were there: 1e-10 m.

    An arc with its lowest point at the ground needs gravity upwards. Kelvin-Voigt is left out: its
    force jumps at any touch.
    """
    robot = vehicles.particle(tmp_path, 0.5)
    contact = hp.Contact(normal=GRAZING[name], friction=TANH)
    half = 0.01
    start = vehicles.state(robot, lowest + 0.5 * G * half**2, (1.0, 0.0, -G * half))
    ends = []
    for height in (0.0, -1.0):  # the ground, and a ground out of reach
        scene = hp.Scene(
            robot,
            terrain=hp.Flat(height=height),
            contact=contact,
            servo=vehicles.LIMP,
            gravity=(0, 0, G),
        )
        trace = hp.simulate(
            scene,
            hp.HoldPosture(),
            duration=0.02,
            method=method,
            step=1e-6,
            sample=half,
            initial=start,
        )
        ends.append(np.concatenate([trace.q[-1], trace.v[-1]]))
    assert np.abs(ends[0] - ends[1]).max() < 1e-10


@pytest.mark.parametrize("name", FRICTION)
@pytest.mark.parametrize("method", ["rk4", "implicit-euler"])
def test_hc33_denormal_start(name: str, method: str, tmp_path: Path) -> None:
    """HC33: a run from depth and velocity 1e-310 stays finite, and, without gravity, at rest."""
    robot = vehicles.particle(tmp_path)
    start = vehicles.state(robot, -1e-310, (1e-310, 1e-310, -1e-310))
    for normal in (*GRAZING.values(), hp.KelvinVoigt(stiffness=1e5, damping=10.0)):
        contact = hp.Contact(normal=normal, friction=FRICTION[name])
        scene = hp.Scene(robot, contact=contact, servo=vehicles.LIMP, gravity=(0, 0, 0))
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.1, method=method, step=1e-3, initial=start
        )
        assert np.isfinite(trace.q).all()
        assert np.abs(trace.v).max() < 1e-300
        assert np.abs(trace.foot_force).max() < 1e-300

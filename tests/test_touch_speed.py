"""Laws that remember the speed of a touch-down: feet that land together, hops within a step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.validation.cases import bodies

G = 9.81
RESTITUTION = hp.contact.Restitution(
    stiffness=1e6, exponent=1.5, restitution=0.2, model="herbert-mcwhannell"
)


def run(scene: hp.Scene, start: hp.State, duration: float, sample: float, **how: Any) -> hp.Trace:
    return hp.simulate(
        scene, hp.HoldPosture(), initial=start, duration=duration, sample=sample, **how
    )


@pytest.mark.parametrize("tilt", [1e-6, 3e-6])
def test_feet_that_land_within_microseconds_keep_a_speed_each(tilt: float) -> None:
    """Where one lands another is already a little deep: taken there its speed is off by g t."""
    robot = hp.load_robot("kharagpur")
    contact = hp.Contact(normal=RESTITUTION, friction=hp.contact.TanhCoulomb(mu=0.5, slope=100.0))
    q, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    q[2] += 0.005
    q[3], q[6] = math.sin(0.5 * tilt), math.cos(0.5 * tilt)

    truth, loose, tight = (
        run(
            hp.Scene(robot, contact=contact), hp.State(q, v), 0.06, 0.01, method=method,
            accuracy=accuracy, estimate=False,
        ).q
        for method, accuracy in (("dop853", 1e-11), ("ndf", 1e-8), ("ndf", 1e-9))
    )  # fmt: skip
    assert loose == pytest.approx(truth, rel=0, abs=0.4e-8)
    assert tight == pytest.approx(truth, rel=0, abs=0.4e-9)


def test_a_hop_on_ground_that_shakes_is_seen() -> None:
    """The ground falls by 1.05 g for a moment: the mass leaves it by micrometres, and lands."""
    amplitude, robot = 1.05 * G / (2.0 * math.pi * 10.0) ** 2, bodies.particle()
    law = hp.contact.Restitution(
        stiffness=1e5, exponent=1.0, restitution=0.3, model="hunt-crossley"
    )
    ground = hp.terrain.ShakingGround(ground=hp.Flat(), amplitude=amplitude, frequency=10.0)
    scene, start = bodies.on_ground(robot, law, terrain=ground), bodies.state(robot, (0, 0, 1e-4))
    truth = run(scene, start, 0.6, 0.12, method="dop853", accuracy=1e-11, estimate=False).q
    for accuracy in (1e-5, 1e-6, 1e-7):
        found = run(scene, start, 0.6, 0.12, method="ndf", accuracy=accuracy, estimate=False).q
        assert found[:, 2] == pytest.approx(truth[:, 2], rel=0, abs=2.0 * accuracy)


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "dop853"])
@pytest.mark.parametrize("speed", [0.05, 0.3])
def test_a_law_that_jumps_decides_at_touch_whether_a_bristle_sticks(
    method: str, speed: float
) -> None:
    """Kelvin-Voigt begins with c v: a fresh bristle sticks where its k z + c u is within mu of it.

    Stuck it is a damped spring of its own beside the fall: u' = -(k z + c u)/m, z' = u.
    """
    drop, damping, mass = 0.2, 12.0, 1.0
    normal = hp.contact.KelvinVoigt(stiffness=4000.0, exponent=1.0, damping=damping)
    bristle = hp.contact.StickSlip(mu=0.5, mu_dynamic=0.1, stiffness=4000.0, damping=6.0)
    robot = bodies.particle()
    scene = bodies.on_ground(robot, normal, friction=bristle)
    begin = bodies.state(robot, (0.0, 0.0, 1e-3))
    v = begin.v.copy()
    v[0], v[2] = speed, -drop
    end = 0.006  # s: 1 ms after touch, which is after 5 ms
    trace = run(
        scene, hp.State(begin.q, v), end, 1e-3, method=method, accuracy=1e-8, estimate=False
    )
    fall = (-drop + math.sqrt(drop**2 + 2.0 * G * 1e-3)) / G  # s, until touch
    sticks = 6.0 * speed < 0.5 * damping * (drop + G * fall)
    matrix = np.array([[-6.0 / mass, -4000.0 / mass], [1.0, 0.0]])
    rates, modes = np.linalg.eig(matrix)
    parts = np.linalg.solve(modes, np.array([speed, 0.0]))
    stuck = (modes @ (np.exp(rates * (end - fall)) * parts)).real[0]
    assert (trace.v[-1, 0] == pytest.approx(stuck, abs=1e-6)) == sticks
    if not sticks:  # 0.1 of the normal force slows it less than half a stuck bristle does
        assert stuck < trace.v[-1, 0] < speed


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "implicit-euler"])
@pytest.mark.parametrize("away", [-0.05, 0.05])
def test_a_point_foot_beside_a_ledge_lands_as_on_flat_ground(method: str, away: float) -> None:
    """The ledge's face is near, never touched: the speed remembered is that on the ground below."""
    robot, height = bodies.particle(), 0.02
    ledge = hp.terrain.Ledge(height=height, edge=0.0)
    how: dict[str, float] = {"step": 1e-4} if method == "implicit-euler" else {"accuracy": 1e-8}

    def places(terrain: hp.Terrain, ground: float) -> np.ndarray:
        start = bodies.state(robot, (away, 0.0, ground + 0.01), (-2.0 * away, 0.0, -0.5))
        scene = bodies.on_ground(robot, RESTITUTION, terrain=terrain)
        trace = run(scene, start, 0.05, 0.05, method=method, estimate=False, **how)
        return trace.q[-1, :3] - np.array([0.0, 0.0, ground])

    level = height if away < 0.0 else 0.0  # the shelf is before the edge
    assert places(ledge, level) == pytest.approx(places(hp.Flat(), 0.0), rel=0, abs=1e-9)


@pytest.mark.parametrize("stroke, cycle", [(0.038, 2.0), (0.086, 1.7)])
def test_a_foot_that_the_last_correction_moves_into_the_ground_has_landed_there(
    stroke: float, cycle: float
) -> None:
    """With the speed of the step before, torques would be off by ten times what the run states."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=stroke, cycle_time=cycle))
    how = {"duration": cycle, "sample": 2e-3}
    truth = hp.simulate(scene, control, method="x3", accuracy=1e-7, estimate=False, **how)
    trace = hp.simulate(scene, control, method="ndf", accuracy=1e-3, **how)
    error = np.abs(trace.torque - truth.torque).max(axis=1)
    assert trace.counters["runs"] == 1
    assert (error <= trace.error.torque).all()


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf"])
@pytest.mark.parametrize("height", [1e-15, -1e-15])
def test_feet_that_stand_are_at_rest_on_either_side_of_rounding(method: str, height: float) -> None:
    """Just above the ground by rounding, they would land with the speed of the first step's end."""
    robot = hp.load_robot("kharagpur")
    scene, standing = hp.Scene(robot), robot.stand()

    def sinking(above: float, **how: Any) -> hp.Trace:
        q = standing.q + above * np.eye(standing.q.size)[2]
        return run(scene, hp.State(q, np.zeros(robot.model.nv)), 0.01, 5e-4, **how)

    truth = sinking(-1e-15, method="dop853", accuracy=1e-10, estimate=False)
    trace = sinking(height, method=method, accuracy=1e-3)
    error = np.abs(trace.torque - truth.torque).max()
    assert error <= trace.error.torque.max()

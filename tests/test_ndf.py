"""NDF 1-5: its linear algebra and its order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
import vehicles

import hexapod_pin as hp
from hexapod_pin.native import _core
from hexapod_pin.simulation.plant import native_plant

STIFF_TANH = hp.Contact(
    normal=hp.contact.HuntCrossley(stiffness=1e8, dissipation=0.2),
    friction=hp.contact.TanhCoulomb(mu=0.7, slope=1e3),
)
BRISTLE = hp.Contact(
    normal=hp.Contact.s1().normal,
    friction=hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
)


def pressed(
    contact: hp.Contact, dense: bool, slip: float
) -> tuple[_core.PlantSettings, np.ndarray, np.ndarray, np.ndarray]:
    """Feet about 0.1 mm in level ground, in a chart turned by 0.3 rad."""
    rng = np.random.default_rng(5)
    robot = hp.load_robot("kharagpur")
    settings = native_plant(hp.Scene(robot, contact=contact), dense=dense)
    n = robot.model.nv
    tilted, level = (pin.rpy.rpyToMatrix(0.1, -0.05, 1.0), pin.rpy.rpyToMatrix(0.0, 0.0, 1.28))
    q0 = pin.neutral(robot.model)
    q0[3:7], q0[7:] = pin.Quaternion(tilted).coeffs(), robot.posture
    xi = np.zeros(n)
    xi[3:6] = pin.log3(tilted.T @ level)
    xi[6:] = rng.normal(size=n - 6) * 3e-4
    q = q0.copy()
    q[3:7], q[7:] = pin.Quaternion(level).coeffs(), q0[7:] + xi[6:]
    gaps = _core.evaluate(settings, q, np.zeros(n), np.zeros(n - 6))["foot_gap"]
    xi[:3] = tilted.T @ [0.2, -0.1, -1e-4 - gaps.mean()]
    v = rng.normal(size=n) * slip
    z = rng.normal(size=(6, 3)) * [1e-4, 1e-4, 0.0]
    bristles = z.ravel() if contact.friction.kind == "stick-slip" else np.zeros(0)
    return settings, q0, np.concatenate([xi, v, bristles]), robot.posture


@pytest.mark.parametrize("dense", [False, True])
@pytest.mark.parametrize(
    ("contact", "slip", "least"),
    [
        (STIFF_TANH, 1e-3, 1e-3),
        (hp.Contact.s2(), 0.1, 5e-3),
        (BRISTLE, 1e-3, 1e-3),
        (BRISTLE, 0.1, 1e-3),
    ],
    ids=["stick", "adams", "bristle", "sliding bristle"],
)
def test_the_stiff_block_solves_the_system_of_the_true_jacobian(
    contact: hp.Contact, slip: float, least: float, dense: bool
) -> None:
    """(I - sJ) x = b, J by central differences of y'."""
    settings, q0, y, held = pressed(contact, dense, slip)
    n, s = len(held) + 6, 1e-4
    b = np.random.default_rng(6).normal(size=len(y)) * 1e-6
    b[2 * n + 2 :: 3] = 0.0  # bristles lie in the ground
    x = _core.chart_rates(settings, q0, y, held, s, b)[1]
    ahead, behind = (
        _core.chart_rates(settings, q0, y + h * x, held, s, b)[0] for h in (1e-3, -1e-3)
    )
    jx = (ahead - behind) / 2e-3
    rest = np.abs(x - s * jx - b)
    for part in (slice(n), slice(n, 2 * n), slice(2 * n, None)):
        if len(y[part]):
            assert rest[part].max() < least * np.abs(s * jx[part]).max()
    assert np.abs(s * jx[n : 2 * n]).max() > 100.0 * np.abs(b).max()  # the stiff part decides


def flight(method: str, accuracy: float) -> hp.Trace:
    robot = hp.load_robot("kharagpur")
    q = robot.stand(robot.posture).q.copy()
    q[2], q[7:] = 1.0, robot.posture + 0.2
    v = np.zeros(robot.model.nv)
    v[:6] = 0.3, -0.2, 1.0, 2.0, -1.0, 4.0
    scene = hp.Scene(robot, servo=hp.Servo(kp=20.0, kd=0.3, limited=False), stops=vehicles.FREE)
    return hp.simulate(
        scene, hp.HoldPosture(), duration=0.2, sample=0.05, method=method, accuracy=accuracy,
        estimate=False, initial=robot.check_state(q, v),
    )  # fmt: skip


def test_free_flight_follows_the_accuracy_at_order_five() -> None:
    """100 times tighter costs 100^(1/6) = 2.2 times the steps at order 5, not 4.6 as at order 2."""
    truth = flight("dop853", 1e-12)
    runs = {accuracy: flight("ndf", accuracy) for accuracy in (1e-6, 1e-8, 1e-10, 1e-12)}
    for accuracy, run in runs.items():
        assert np.abs(run.q - truth.q).max() < 3.0 * accuracy
    steps = [run.counters["steps"] for run in runs.values()]
    assert all(after < 2.6 * before for before, after in pairwise(steps))
    assert runs[1e-12].counters["order_mean"] > 4.7

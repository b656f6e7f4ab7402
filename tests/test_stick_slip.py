"""A standing robot under a side load: what each friction law does with it, at 1 ms."""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp

NORMAL = hp.Contact.s1().normal
STIFF = hp.Servo(kp=1000.0, kd=20.0, limited=False)
STICK = hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)
CREEPING = {
    "tanh": hp.contact.TanhCoulomb(mu=0.7, slope=1e3),
    "adams": hp.contact.AdamsCoulomb(
        mu_static=0.7, mu_dynamic=0.5, stiction_speed=1e-3, transition_speed=1e-2
    ),
    "smooth-step": hp.contact.SmoothStep(mu_static=0.7, mu_dynamic=0.7, speed=1e-3),
    "brown-mcphee": hp.contact.BrownMcPhee(mu_static=0.7, mu_dynamic=0.6, speed=1e-3),
}


def push(law: object, ratio: float, duration: float) -> hp.Trace:
    """Kharagpur on ground tilted sideways; `ratio` is the side load over the normal load."""
    cosine = 9.81 / np.hypot(1.0, ratio)
    scene = hp.Scene(
        hp.load_robot("kharagpur"),
        contact=hp.Contact(normal=NORMAL, friction=law),
        servo=STIFF,
        gravity=(0.0, ratio * cosine, -cosine),
    )
    return hp.simulate(scene, hp.HoldPosture(), duration=duration, sample=0.01)


def side_speed(trace: hp.Trace, seconds: float) -> float:
    """Mean side speed of the trunk over the last `seconds` [m/s]."""
    samples = round(seconds / 0.01)
    return float(trace.q[-1, 1] - trace.q[-1 - samples, 1]) / seconds


@pytest.mark.parametrize("name", CREEPING)
def test_a_pushed_robot_creeps_at_the_laws_own_speed(name: str) -> None:
    """20 % of the weight, mu 0.7: every foot at the speed where m(s) = 0.2, to 1e-4 after 10 s."""
    law = CREEPING[name]
    trace = push(law, 0.2, 12.0)
    assert side_speed(trace, 2.0) == pytest.approx(law.creep_speed(0.2), rel=1e-4)


def test_a_pushed_robot_on_bristles_does_not_creep() -> None:
    trace = push(STICK, 0.2, 6.0)
    assert abs(side_speed(trace, 2.0)) < 1e-12  # the issue asks 1e-6 m/s; this is round-off
    assert np.abs(trace.v[-1]).max() < 1e-9


def test_bristles_hold_just_below_and_slide_just_above_the_friction_angle() -> None:
    held = push(STICK, 0.98 * 0.7, 3.0)
    assert abs(side_speed(held, 1.0)) < 1e-9
    slid = push(STICK, 1.02 * 0.7, 3.0)
    # Coulomb: a = g (sin - mu cos), gained over the last second on top of what it had
    angle = np.arctan(1.02 * 0.7)
    expected = 9.81 * (np.sin(angle) - 0.7 * np.cos(angle))
    late, early = side_speed(slid, 0.1), slid.q[-101, 1] - slid.q[-111, 1]
    assert late - early / 0.1 == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("friction", [STICK, CREEPING["tanh"], CREEPING["adams"]])
@pytest.mark.parametrize("normal", [NORMAL, hp.Contact.s2().normal, hp.Contact.accurate().normal])
def test_energy_residual_of_a_walk_falls_with_the_step(normal, friction) -> None:
    """First order: a quarter of the step leaves well under half of the residual (HC31)."""
    scene = hp.Scene(
        hp.load_robot("kharagpur"), contact=hp.Contact(normal=normal, friction=friction)
    )
    control = hp.KinematicControl(hp.Gait.tetrapod())
    # Friction that falls with speed on S2's stiff contact: the touch-down at 0.8 s needs 0.125 ms.
    stiff = friction is CREEPING["adams"] and isinstance(normal, hp.contact.AdamsImpact)
    largest, duration = (1.25e-4, 0.9) if stiff else (1e-3, 2.4)

    def residual(step: float) -> float:
        trace = hp.simulate(scene, control, duration=duration, step=step, sample=0.01)
        return float(np.abs(trace.energy_residual).max())

    coarse, fine = residual(largest), residual(0.25 * largest)
    assert fine < 0.5 * coarse
    assert coarse < 0.02  # of about 0.3 J that pass through the contacts


def test_explicit_walk_on_bristles_keeps_its_energy_account() -> None:
    """RK4 at 1e-5 s: the residual stays below 1e-6 of the work of the servos."""
    contact = hp.Contact(normal=NORMAL, friction=STICK)
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact)
    control = hp.KinematicControl(hp.Gait.tetrapod())
    trace = hp.simulate(scene, control, duration=0.5, method="rk4", step=1e-5, sample=0.01)
    rate = trace.torque * trace.v[:, 6:]
    throughput = np.trapezoid(np.abs(rate).sum(axis=1), trace.time)
    assert np.abs(trace.energy_residual).max() < 1e-6 * throughput
    for loss in ("normal_loss", "friction_loss"):
        assert np.diff(trace.energy[loss]).min() > -1e-9

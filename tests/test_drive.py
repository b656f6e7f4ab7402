"""The drive's law: slopes and switches in every mode, gains and motors by joint, TOML."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.drive.drive_law import armature, drive_law, native_gear, torque_cap
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.plant import native_plant

LIMIT, STOP, FRICTION = native.LimitMode, native.StopMode, native.FrictionMode
MOTOR = hp.Motor(
    stall_torque=2.0, no_load_speed=5.0, voltage_ratio=0.8, rotor_inertia=1e-6, gear_ratio=100.0,
    viscous_friction=0.01, dry_friction=0.2,
)  # fmt: skip


@pytest.fixture(scope="module")
def kharagpur() -> hp.Robot:
    return hp.load_robot("kharagpur")


GEAR = hp.drive.GearFriction(
    coulomb=0.02, stribeck=0.05, motor=0.2, load=0.1, motor_stribeck=0.05, load_stribeck=0.1,
    motor_quadratic=0.03, load_quadratic=0.02, stribeck_speed=1.5, stribeck_exponent=1.3,
)  # fmt: skip


def law(*, gear: Sequence[Any] = (), **changes: Any) -> Any:
    numbers = {
        "kp": 10.0, "kd": 0.5, "cap": 1.0, "line_torque": 1.6, "line_slope": 0.4,
        "damping": 0.03, "friction": 0.2, "lower": -1.0, "upper": 1.0, **changes,
    }  # fmt: skip
    arrays = {name: np.array([value]) for name, value in numbers.items()}
    stops = {"stop_stiffness": np.array([50.0]), "stop_dissipation": 0.3}
    return native.drive_law(**arrays, **stops, gear=gear)


def torque_by_hand(angle: float, rate: float, demand: float) -> float:
    lower, upper = -1.6 - 0.4 * rate, 1.6 - 0.4 * rate
    motor = min(max(min(max(demand, lower), upper), -1.0), 1.0)
    depth = max(angle - 1.0, 0.0) + min(angle + 1.0, 0.0)
    stop = -50.0 * depth * max(0.0, 1.0 + 0.45 * np.sign(depth) * rate)
    return motor - 0.03 * rate - 0.2 * np.sign(rate) + stop


ANGLES, RATES, DEMANDS = (
    (-1.02, 0.3, 1.04), (-7.0, -4.1, -0.2, 0.3, 2.0, 6.5), (-3.0, -0.5, 0.9, 3.0),
)  # fmt: skip
STATES = list(itertools.product(ANGLES, RATES, DEMANDS))


def test_law_by_hand() -> None:
    drive, seen = law(), set()
    for angle, rate, demand in STATES:
        mode = drive.mode(0, angle, rate, demand)
        seen |= {mode.limit, mode.stop, mode.friction}
        torque, _, _ = drive.torque(0, mode, angle, rate, demand)
        assert torque == pytest.approx(torque_by_hand(angle, rate, demand), abs=1e-13)
    assert seen >= {*LIMIT, *STOP, FRICTION.forward, FRICTION.backward}


@pytest.mark.parametrize("external_load", [None, False, True])
def test_slopes_against_differences(external_load: bool | None) -> None:
    gears = []
    if external_load is not None:
        gears = [native_gear(GEAR.model_copy(update={"external_load": external_load}), 0.03)]
    drive, plain, h = law(gear=gears), law(friction=0.0, damping=0.0), 1e-6
    for limit, stop, friction in itertools.product(LIMIT, STOP, FRICTION):
        mode, free = native.DriveMode(), native.DriveMode()
        mode.limit, mode.stop, mode.friction = limit, stop, friction
        free.stop = stop
        side = -1.03 if stop in (STOP.lower, STOP.lower_released) else 1.03
        moving = -0.7 if friction == FRICTION.backward else 0.7

        def found(q: float, v: float, mode: Any = mode, free: Any = free) -> tuple[float, ...]:
            demand = drive.demand(0, 0.2 - q, 0.1 - v, 0.05)
            external = 0.3 + plain.torque(0, free, q, v, 0.0)[0]
            return tuple(drive.torque(0, mode, q, v, demand, external))

        _, stiffness, damping = found(side, moving)
        by_angle = (found(side + h, moving)[0] - found(side - h, moving)[0]) / (2.0 * h)
        by_rate = (found(side, moving + h)[0] - found(side, moving - h)[0]) / (2.0 * h)
        assert stiffness == pytest.approx(-by_angle, abs=1e-7), mode
        assert damping == pytest.approx(-by_rate, abs=1e-7), mode


def test_armature_and_motors_of_some_joints(kharagpur: hp.Robot) -> None:
    """J n^2 joins the diagonal of the mass matrix; joints without a motor keep the effort alone."""
    plain = hp.Scene(kharagpur, servo=hp.Servo(kp=20.0, kd=0.4))
    geared = hp.Scene(kharagpur, servo=hp.Servo(kp=20.0, kd=0.4, motor=MOTOR))
    state = kharagpur.stand()
    args = (state.q, np.ones(24), np.zeros(18))
    before = native.evaluate(native_plant(plain), *args)["mass"]
    after = native.evaluate(native_plant(geared), *args)["mass"]
    expected = np.diag([0.0] * 6 + [1e-2] * 18)
    np.testing.assert_allclose(after - before, expected, atol=1e-12)
    strong = hp.Motor(stall_torque=2.0, no_load_speed=5.0, peak_torque=1.5, rotor_inertia=1e-4)
    servo = hp.Servo(kp=20.0, kd=0.4, motor={"femur": strong})
    cap = torque_cap(kharagpur, servo).reshape(6, 3)
    np.testing.assert_array_equal(cap[:, 0], kharagpur.effort_limit.reshape(6, 3)[:, 0])
    np.testing.assert_array_equal(cap[:, 1], 1.5)
    np.testing.assert_array_equal(armature(kharagpur, servo), np.tile([0.0, 1e-4, 0.0], 6))
    drive = drive_law(kharagpur, servo, hp.JointStops(stiffness=0.0))
    assert drive.motor_torque(0, 4.0, 100.0) == min(4.0, kharagpur.effort_limit[0])
    assert drive.motor_torque(1, 4.0, 4.0) == pytest.approx(2.0 - 2.0 * 4.0 / 5.0)


def test_gains_by_kind_name_and_sequence(kharagpur: hp.Robot) -> None:
    servo = hp.Servo(kp={"coxa": 1.0, "femur": 2.0, "tibia": 3.0, "lm_femur_joint": 9.0}, kd=0.1)
    kp, kd = servo.gains(kharagpur)
    wanted = np.tile([1.0, 2.0, 3.0], 6)
    wanted[kharagpur.joint_index("lm_femur_joint")] = 9.0
    np.testing.assert_array_equal(kp, wanted)
    np.testing.assert_array_equal(kd, np.full(18, 0.1))
    given = np.arange(18.0)
    np.testing.assert_array_equal(hp.Servo(kp=given, kd=0).gains(kharagpur)[0], given)


@pytest.mark.parametrize(
    ("fields", "name", "value", "allowed"),
    [
        ({"kp": {"coxa": -1.0}}, "Servo.kp.coxa", -1.0, ()),
        ({"kp": [1.0, -2.0]}, "Servo.kp[1]", -2.0, ()),
        ({"kp": {"coxa": 1.0, "femur": 2.0}}, "Servo.kp[lf_tibia_joint]", None, ()),
        ({"kp": {"hip": 1.0}}, "Servo.kp[hip]", "hip", ()),
        ({"kp": [1.0, 2.0]}, "Servo.kp", (1.0, 2.0), (18,)),
        ({"kp": 1.0, "motor": {"elbow": MOTOR}}, "Servo.motor[elbow]", "elbow", ()),
    ],
)
def test_errors_name_the_joint(kharagpur, fields, name, value, allowed):
    with refused(ParameterError, name, value, allowed=allowed):
        native_plant(hp.Scene(kharagpur, servo=hp.Servo(**{"kd": 0.1, **fields})))

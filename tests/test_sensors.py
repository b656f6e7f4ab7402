"""Sensors: what noise, offset, rounding and threshold make of a measurement."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from foot_control_runs import reading
from refusals import refused
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

import hexapod_pin as hp
from hexapod_pin.control.sensors import BLOCK_TICKS, QUANTITIES
from hexapod_pin.robot import rotations

VECTORS = tuple(name for name in QUANTITIES if name != "rotation")
TICKS = 2 * BLOCK_TICKS + 3  # over two borders of blocks
NOISY = hp.sensors.Sensors(
    **dict.fromkeys(QUANTITIES, hp.sensors.Sensor(noise=0.02, bias=0.1)), seed=7
)


def still(batch: int, value: float = 0.0, turned: bool = False) -> hp.feedback.Measurement:
    level = reading("kharagpur", batch=batch, loaded=np.ones((batch, 6), dtype=bool))
    turns = Rotation.random(batch, random_state=3).as_matrix() if turned else level.rotation
    values = {name: np.full_like(getattr(level, name), value) for name in VECTORS}
    return replace(level, rotation=turns, **values)


def errors(sensors: hp.sensors.Sensors, name: str, ticks: int, cases: range) -> np.ndarray:
    reader, truth = sensors.start(cases), still(len(cases))
    readings = [getattr(reader.read(tick, truth), name) for tick in range(ticks)]
    return np.stack(readings).reshape(ticks, len(cases), -1)


@pytest.mark.parametrize("name", VECTORS)
def test_noise_is_normal_with_the_stated_deviation(name: str):
    sensors = hp.sensors.Sensors(**{name: hp.sensors.Sensor(noise=0.02)})
    found = errors(sensors, name, 500, range(8)).ravel() / 0.02
    assert abs(found.mean()) < 5 / np.sqrt(found.size)
    assert abs(found.std() - 1) < 5 / np.sqrt(2 * found.size)
    assert kstest(found, "norm").pvalue > 1e-4


def test_errors_of_cases_ticks_components_and_quantities_are_independent():
    """No correlation above 6 standard errors (92 000 pairs: chance 2e-4), hardly two equal."""
    rows = []
    for name in ("q", "v", "torque"):
        sensors = hp.sensors.Sensors(**{name: hp.sensors.Sensor(noise=1.0)})
        noise = errors(sensors, name, 2000, range(3))
        rows += [noise[:, case, joint] for case in range(3) for joint in range(18)]
    for lag in (0, 1, 2, BLOCK_TICKS):
        ahead, behind = np.array(rows)[:, lag:], np.array(rows)[:, : 2000 - lag]
        correlation = ahead @ behind.T / ahead.shape[1]
        if lag == 0:
            np.fill_diagonal(correlation, 0.0)
        assert np.abs(correlation).max() < 6 / np.sqrt(ahead.shape[1])
    assert len(np.unique(rows)) > 0.99 * np.size(rows)  # of 24 bits: a few agree by chance


def test_offset_is_drawn_once_per_run_and_component():
    found = errors(hp.sensors.Sensors(q=hp.sensors.Sensor(bias=0.3)), "q", TICKS, range(200))
    assert np.ptp(found, axis=0).max() == 0.0
    assert abs(found[0].mean()) < 5 * 0.3 / np.sqrt(3600)
    assert abs(found[0].std() - 0.3) < 5 * 0.3 / np.sqrt(7200)
    noise = errors(hp.sensors.Sensors(q=hp.sensors.Sensor(noise=0.3)), "q", 1, range(200))
    assert abs((found[0] * noise[0]).mean()) < 5 * 0.3**2 / np.sqrt(3600)  # of another stream


def test_orientation_stays_a_rotation_and_turns_in_trunk_axes():
    """truth^T reading = exp(w~); each component of w has the stated deviation, none a mean."""
    measurement, noise = still(64, 0.7, turned=True), 0.02
    reader = hp.sensors.Sensors(rotation=hp.sensors.Sensor(noise=noise)).start(range(64))
    vectors = []
    for tick in range(200):
        read = reader.read(tick, measurement).rotation
        assert np.abs(np.swapaxes(read, 1, 2) @ read - np.eye(3)).max() < 1e-15
        relative = np.swapaxes(measurement.rotation, 1, 2) @ read
        vectors.append(Rotation.from_matrix(relative).as_rotvec())
    found = np.array(vectors).reshape(-1, 3) / noise
    assert np.abs(found.mean(axis=0)).max() < 5 / np.sqrt(len(found))
    assert np.abs(found.std(axis=0) - 1).max() < 5 / np.sqrt(2 * len(found))
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()[None]
    biased = hp.sensors.Sensors(rotation=hp.sensors.Sensor(bias=0.1))
    body = biased.start([0]).read(0, still(1)).rotation[0]
    seen = biased.start([0]).read(0, replace(still(1), rotation=quarter)).rotation[0]
    np.testing.assert_allclose(seen, quarter[0] @ body, atol=1e-15)


@pytest.mark.parametrize(("truth", "rounded"), [(0.26, 0.3), (-0.26, -0.3), (0.24, 0.2)])
def test_rounding_is_to_the_nearest_step_of_a_component_or_of_roll_pitch_and_yaw(truth, rounded):
    sensors = hp.sensors.Sensors(**{name: hp.sensors.Sensor(quantisation=0.1) for name in VECTORS})
    read = sensors.start([0]).read(0, still(1, truth))
    for name in VECTORS:
        np.testing.assert_allclose(getattr(read, name), rounded, atol=1e-16)
    turn = Rotation.from_euler("ZYX", [[2.93, -0.26, 0.14], [-3.04, 1.24, -1.58]]).as_matrix()
    sensors = hp.sensors.Sensors(rotation=hp.sensors.Sensor(quantisation=0.1))
    found = sensors.start([0, 1]).read(0, replace(still(2), rotation=turn)).rotation
    expected = [rotations.rotation((0.1, -0.3, 2.9)), rotations.rotation((-1.6, 1.2, -3.0))]
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_roll_pitch_yaw_give_their_rotation_back_also_where_two_turn_about_one_axis():
    for pitch in (np.pi / 2, -np.pi / 2, 0.3):
        turn = Rotation.from_euler("ZYX", [0.7, pitch, -1.1]).as_matrix()
        back = rotations.rotation_from_angles(rotations.roll_pitch_yaw(turn))
        np.testing.assert_allclose(back, turn, atol=1e-15)


def bits(measurement: hp.feedback.Measurement, row: int) -> bytes:
    names = [field.name for field in fields(measurement) if field.name != "time"]
    return b"".join(getattr(measurement, name)[row].tobytes() for name in names)


def test_same_bits_for_any_company_and_for_a_cut():
    rough = dict.fromkeys(QUANTITIES, hp.sensors.Sensor(noise=0.03, bias=0.1, quantisation=1e-3))
    sensors, truth = (
        hp.sensors.Sensors(**rough, loaded_threshold=1.0, seed=2),
        still(64, 0.7, turned=True),
    )

    def of(cases: list[int]) -> hp.feedback.Measurement:
        names = [field.name for field in fields(truth) if field.name != "time"]
        return replace(truth, **{name: getattr(truth, name)[cases] for name in names})

    groups = [[5], [9, 5, 63, 0, 1, 2, 3], list(range(64))]
    readers = [(cases, sensors.start(cases), of(cases)) for cases in groups]
    for tick in [*range(3), *range(BLOCK_TICKS - 2, BLOCK_TICKS + 2), TICKS, 10**12]:
        found = {bits(reader.read(tick, m), cases.index(5)) for cases, reader, m in readers}
        found.add(bits(sensors.start([5]).read(tick, of([5])), 0))
        assert len(found) == 1


def test_loaded_follows_the_force_as_read():
    force = np.zeros((1, 6, 3))
    force[0, :3] = [[3.0, 0.0, 4.0], [0.0, 0.0, -5.2], [0.0, 0.0, 4.9]]  # sizes 5, 5.2, 4.9
    truth = replace(still(1), foot_force=force)
    read = hp.sensors.Sensors(loaded_threshold=4.95).start([0]).read(0, truth)
    assert read.loaded.tolist() == [[True, True, False, False, False, False]]
    assert read.foot_force is force
    steps = hp.sensors.Sensor(quantisation=1.0)
    coarse = hp.sensors.Sensors(loaded_threshold=4.95, foot_force=steps)
    assert coarse.start([0]).read(0, truth).loaded.tolist()[0][:3] == [True, True, True]
    assert NOISY.start([0]).read(0, truth).loaded is truth.loaded


def test_bad_settings_cases_ticks_and_rows_are_refused():
    for given, name in (
        ({"delay": -0.1}, "Sensors.delay"),
        ({"seed": 2**63}, "Sensors.seed"),
        ({"q": {"noise": -1e-3}}, "Sensors.q.noise"),
        ({"v": 0.1}, "Sensors.v"),
    ):
        with refused(hp.errors.ParameterError, name):
            hp.sensors.Sensors(**given)
    with refused(hp.errors.ParameterError, "case_numbers"):
        NOISY.start([2**64])
    with refused(hp.errors.ParameterError, "tick", -1):
        NOISY.start([0]).read(-1, still(1))
    with refused(hp.errors.StateError, about=("measurement.q", "(2,)", "1")):
        NOISY.start([0]).read(0, still(2))

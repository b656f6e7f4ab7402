"""Gaits at equal speed and step height: `hp.study.gait_energy`, its costs, file and figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, StudyInterrupted, TraceFileError, UnknownNameError
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.results.result_files import netcdf_groups
from hexapod_pin.results.schema import schema
from hexapod_pin.study.sweep.base_case import walk_times
from hexapod_pin.view import write_gait_energy_figure

ROBOT = hp.load_robot("kharagpur")
SCENES = {
    "s2": hp.Scene(ROBOT, contact=hp.Contact.preset("s2")),
    "motors": hp.Scene(
        ROBOT,
        servo=hp.Servo(kp=240.0, kd=4.8, motor=hp.Motor(stall_torque=8.0, no_load_speed=10.0)),
    ),
}
GAITS = {"tripod": hp.Gait.tripod(), "wave 3/4": hp.Gait.wave(3 / 4)}
SPEEDS = (0.1, 0.16, 0.4)


@pytest.fixture(scope="module")
def found() -> hp.study.GaitEnergy:
    return hp.study.gait_energy(SCENES, GAITS, SPEEDS, stroke=0.1, check=2)


def test_costs_are_those_of_each_walk(found: hp.study.GaitEnergy) -> None:
    """To the bit: budget and summary of the same run; the electrical cost from samples, 2 %."""
    gait = GAITS["tripod"].with_changes(stroke=0.1, cycle_time=0.1 / (0.5 * 0.16), lift=0.02)
    duration, sample = walk_times(gait.cycle_time, 1)
    for scene, gamma in (("s2", 1.0), ("motors", 1.25)):
        trace = hp.simulate(
            SCENES[scene],
            hp.KinematicControl(gait),
            duration=duration,
            sample=sample,
            until="steady",
            accuracy=1e-4,
        )
        budget = hp.torque_budget(trace)
        assert found.of("cost_of_transport", scene)[0, 1] == budget.cost_of_transport
        assert (
            found.of("cost_of_transport_positive", scene)[0, 1] == budget.cost_of_transport_positive
        )
        assert found.of("measured_speed", scene)[0, 1] == budget.measured_speed
        steady = trace.time >= 2.0 * gait.cycle_time - 1e-9
        time, torque, rate = trace.time[steady], trace.torque[steady], trace.v[steady, 6:]
        square = np.trapezoid(torque**2, time, axis=0)
        work = np.trapezoid((torque * rate).sum(axis=1), time)
        distance = budget.distance
        electrical = (work + gamma * square.sum()) / (ROBOT.total_mass * 9.81 * distance)
        got = found.of("cost_of_transport_electrical", scene)[0, 1]
        assert got == pytest.approx(electrical, rel=0.02)
        assert found.of("torque_index", scene)[0, 1] == pytest.approx(
            square.sum() / distance, rel=0.02
        )
        largest = found.of("torque_index_largest", scene)[0, 1]
        assert largest == pytest.approx(square.max() / distance, rel=0.02)


def test_the_copper_loss_is_that_of_the_limits(found: hp.study.GaitEnergy) -> None:
    """6 rad/s over 6 N m, *assumed*; and R / (k N)^2 of a motor given by its two end points."""
    np.testing.assert_allclose(found.copper_loss, 1.0, rtol=1e-12)
    assert any("electrical loss" in text for text in found.run.assumed)
    voltage, resistance, constant, gear = 12.0, 2.0, 0.012, 200.0
    motor = hp.Motor(
        stall_torque=voltage / resistance * constant * gear,
        no_load_speed=voltage / (constant * gear),
    )
    scene = hp.Scene(ROBOT, servo=hp.Servo(kp=240.0, kd=4.8, motor=motor))
    got = hp.study.gait_energy(scene, GAITS, [0.1], stroke=0.06, accuracy=1e-2, check=0).copper_loss
    np.testing.assert_allclose(got, resistance / (constant * gear) ** 2, rtol=1e-12)


def test_gaits_walk_at_equal_speed_and_step_height(found: hp.study.GaitEnergy) -> None:
    """Measured speeds within 1 % of the commanded one, whatever the gait and the scene."""
    share = found.measured_speed / np.array(SPEEDS)
    assert np.nanmax(np.abs(share - 1.0)) < 0.01
    np.testing.assert_allclose(found.stroke[np.isfinite(found.stroke)], 0.1, rtol=1e-12)
    expected = 0.1 / (found.duty[:, None] * np.array(SPEEDS))
    np.testing.assert_allclose(
        np.where(np.isnan(found.of("cycle_time")), expected, found.of("cycle_time")),
        expected,
        rtol=1e-12,
    )
    equal = hp.study.gait_energy(
        SCENES["s2"], GAITS, [0.08], cycle_time=1.0, accuracy=1e-3, check=0
    )
    np.testing.assert_allclose(equal.stroke[0, :, 0], 0.08 * found.duty, rtol=1e-12)
    assert equal.run.rule == "equal cycle time"


def test_what_the_joints_cannot_follow_is_nan_with_its_reason(found: hp.study.GaitEnergy) -> None:
    """Low duty is cheaper where all walk: the sign that Roy and Pratihar report, physics 2.5."""
    assert np.isnan(found.cost_of_transport[:, 1, 2]).all()
    assert all("its limit is 6 rad/s" in text for text in found.reason[:, 1, 2])
    assert (found.reason[:, 0, :2] == "").all()
    assert found.cheapest(scene="s2")[2].gaits in (("tripod",), ())
    test = found.duty_test("cost_of_transport_positive", "s2")
    assert test is not None and test.low_is_cheaper
    assert test.speed == 0.16 and test.gaits == ("tripod", "wave 3/4")
    assert test.cost[0] < test.cost[1]


def test_ties_within_the_stated_error_are_listed() -> None:
    """Costs made up: 1 % apart with a stated error of 1 %, then of 0.1 %."""
    base = hp.study.gait_energy(SCENES["s2"], GAITS, [0.1], stroke=0.06, accuracy=1e-3, check=0)
    costs = np.array([[[1.00], [1.01]]])
    for error, names in ((0.01, ("tripod", "wave 3/4")), (0.001, ("tripod",))):
        made = altered(base, costs, error)
        assert made.cheapest("cost_of_transport")[0].gaits == names
        assert made.tie("cost_of_transport") == pytest.approx(2.0 * error)
    test = altered(base, costs[:, ::-1], 0.001).duty_test("cost_of_transport")
    assert test is not None and not test.low_is_cheaper and test.duty == (0.5, 0.75)
    assert altered(base, costs, 0.001).duty_test("cost_of_transport").low_is_cheaper
    with refused(UnknownNameError, kind="cost", name="joy", known=list(COSTS)):
        base.cheapest("joy")


def altered(base: hp.study.GaitEnergy, costs: np.ndarray, error: float) -> hp.study.GaitEnergy:
    """Return what was found with other costs of transport and another stated error."""
    from dataclasses import replace

    from hexapod_pin.results.grid_columns import AccuracyCheck

    check = AccuracyCheck(1e-4, np.zeros((1, 3), dtype=int), ("cost_of_transport",), [[error]])
    return replace(base, cost_of_transport=costs, check=check)


def test_one_file_holds_the_whole_study(found: hp.study.GaitEnergy, tmp_path: Path) -> None:
    import xarray

    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.8))
    parts = {
        "gait_energy": found,
        "torque_map_straight": hp.torque_map(
            SCENES["s2"], "straight", strokes=[0.06], cycle_times=[0.9], accuracy=1e-3, check=1
        ),
        "walk": hp.simulate(SCENES["s2"], walk, duration=0.1),
    }
    path = hp.study.write_study(tmp_path / "study.nc", parts)
    assert netcdf_groups(path) == tuple(sorted(parts))
    assert hp.study.load_study(path) == parts
    with xarray.open_dataset(path, group="gait_energy", engine="h5netcdf") as data:
        for name in schema(hp.study.GaitEnergy):
            assert {"units", "long_name"} <= set(data[name].attrs)
        assert data["cost_of_transport"].sel(gait="tripod", scene="s2").shape == (3,)
    assert hp.study.load_gait_energy(found.save(tmp_path / "alone.nc")) == found
    with refused(TraceFileError, about=("alone.nc", "hexapod_pin.gait_energy")):
        hp.study.load_study(tmp_path / "alone.nc")
    with refused(ParameterError, "parts", "a/b"):
        hp.study.write_study(tmp_path / "no.nc", {"a/b": found})


def test_table_and_figure(found: hp.study.GaitEnergy, tmp_path: Path) -> None:
    text = found.table("cost_of_transport", "s2")
    assert "tripod" in text and "*" in text.splitlines()[2]
    path = write_gait_energy_figure(found, tmp_path / "energy.png", costs=COSTS)
    assert path.stat().st_size > 10_000
    with refused(ParameterError, "costs", "joy"):
        write_gait_energy_figure(found, tmp_path / "x.png", costs=["joy"])


@pytest.mark.parametrize(
    ("change", "name", "value"),
    [
        ({"speeds": ()}, "speeds", ()), ({"gaits": {}}, "gaits", {}),
        ({"copper_loss": -1.0}, "copper_loss", -1.0),
        ({"stroke": 0.1, "cycle_time": 1.0}, "cycle_time", 1.0), ({"scenes": {}}, "scenes", {}),
        ({"scenes": {"a": ROBOT}}, "gait_energy.scenes[a]", ROBOT),
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_refused(change: dict, name: str, value: object) -> None:
    settings = {"scenes": SCENES, "gaits": GAITS, "speeds": SPEEDS, **change}
    with refused(ParameterError, name, value):
        hp.study.gait_energy(**settings)


def test_an_interrupted_study_keeps_what_is_done() -> None:
    def stop(fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(StudyInterrupted) as caught:
        hp.study.gait_energy(SCENES["s2"], GAITS, [0.1], stroke=0.06, accuracy=1e-3, progress=stop)
    assert np.isfinite(caught.value.result.cost_of_transport).sum() == 1

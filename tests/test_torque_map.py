"""Torque against stroke and cycle time, costs of gaits: values of single walks, phases, files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import FEET, JOINTS, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.results.grid_columns import AccuracyCheck
from hexapod_pin.results.phase_torque import PROTRACTION, RETRACTION, scheduled_phase_torque
from hexapod_pin.results.result_files import netcdf_groups
from hexapod_pin.results.schema import schema
from hexapod_pin.study.sweep.base_case import walk_times
from hexapod_pin.study.torque_map import PHASE_SAMPLES
from hexapod_pin.view import write_gait_energy_figure, write_torque_curves

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT, contact=hp.Contact.preset("s2"))
STROKES, TIMES = (0.06, 0.14), (0.8, 1.2)
RADIUS = 0.20284  # [m], physics 2.2: L1 + L2


@pytest.fixture(scope="module")
def found() -> hp.study.TorqueMap:
    fractions: list[float] = []
    got = hp.torque_map(
        SCENE, "arc", strokes=STROKES, cycle_times=TIMES, check=2, progress=fractions.append
    )
    assert fractions == sorted(fractions) and len(fractions) == 6
    return got


def arc(stroke: float, period: float) -> hp.motion.ArcWalk:
    """S2's walk with a stroke, from the closed form 2 R sin A."""
    return hp.motion.ArcWalk(
        hp.Gait.tetrapod(cycle_time=period), amplitude=float(np.arcsin(stroke / (2 * RADIUS)))
    )


def test_a_point_is_what_its_walk_comes_to(found: hp.study.TorqueMap) -> None:
    """To the bit, with the same controller; the summary and its budget are computed alike."""
    i, j = 1, 0
    radius = float(hp.motion.ArcWalk().path(ROBOT).radius.mean())
    walk = hp.motion.ArcWalk(
        hp.Gait.tetrapod(cycle_time=TIMES[j]), amplitude=float(np.arcsin(STROKES[i] / (2 * radius)))
    )
    duration, sample = walk_times(TIMES[j], 1, PHASE_SAMPLES)
    how = {"duration": duration, "until": "steady", "accuracy": 1e-4, "sample": sample}
    trace = hp.simulate(SCENE, walk, **how)
    budget = hp.torque_budget(trace)
    for name in ("torque_peak", "torque_p99", "torque_rms", "speed_peak"):
        assert getattr(found, name)[i, j].tolist() == [getattr(x, name) for x in budget.joints]
    assert found.cost_of_transport[i, j] == budget.cost_of_transport
    assert found.normal_impulse[i, j].tolist() == trace.summary.normal_impulse.tolist()
    femur = found.of_kind("torque_peak", "femur")[i, j]
    assert femur == budget.kind("femur").peak.torque_peak
    energy = found.of_kind("positive_energy", "coxa")[i, j]
    assert energy == pytest.approx(budget.kind("coxa").positive_energy, rel=1e-12)


def test_phases_part_the_window(found: hp.study.TorqueMap) -> None:
    """Times add up to the cycle, mean squares to that of the window; the duty is the gait's."""
    cycle = np.broadcast_to(np.array(TIMES)[:, None], (2, 2, 18))
    np.testing.assert_allclose(found.phase_time.sum(axis=2), cycle, rtol=1e-12)
    np.testing.assert_allclose(found.phase_time[:, :, 0], 2 / 3 * cycle, rtol=1e-9)
    square = (found.phase_torque_rms**2 * found.phase_time).sum(axis=2) / cycle
    missed = np.abs(square - found.torque_rms**2) * cycle
    rms = found.phase_torque_rms
    bound = np.sqrt(rms**2 + missed[:, :, None] / found.phase_time) - rms
    np.testing.assert_allclose(found.phase_torque_rms_error, bound, atol=1e-9)
    assert found.phase_torque_rms_error.max() < 0.02 * rms.max()
    # of samples, and of accepted states, which lie elsewhere: apart by what a peak falls in 1 ms
    np.testing.assert_allclose(found.phase_torque_peak.max(axis=2), found.torque_peak, rtol=2e-3)
    weight = ROBOT.total_mass * 9.81  # impulses of a periodic walk, but for the rise of its trunk
    total = found.normal_impulse.sum(axis=-1)
    np.testing.assert_allclose(total, np.broadcast_to(weight * np.array(TIMES), (2, 2)), rtol=1e-4)


def test_the_stroke_of_an_arc_walk_is_the_one_requested(found: hp.study.TorqueMap) -> None:
    """V = stroke / (duty T); the amplitude from R as published agrees to its rounding, 1e-5."""
    expected = np.array(STROKES)[:, None] / (2.0 / 3.0 * np.array(TIMES))
    np.testing.assert_allclose(found.nominal_speed, expected, rtol=1e-12)
    assert arc(0.14, 1.2).path(ROBOT).speed == pytest.approx(expected[1, 1], rel=2e-5)
    how = {"strokes": [0.06], "cycle_times": [0.9], "accuracy": 1e-2, "check": 0}
    own = hp.torque_map(
        SCENE, lambda a, b: hp.KinematicControl(hp.Gait.tripod(stroke=a, cycle_time=b)), **how
    )  # of one's own: the same bits
    straight = hp.torque_map(SCENE, "straight", gait=hp.Gait.tripod(), **how)
    assert (own.torque_rms == straight.torque_rms).all()


def test_phases_are_those_of_the_legs() -> None:
    """Against a loop over joints and samples, with legs and schedule looked up by name."""
    walk, period = arc(0.1, 0.9), 0.9
    duration, sample = walk_times(period, 1, PHASE_SAMPLES)
    trace = hp.simulate(SCENE, walk, duration=duration, sample=sample, accuracy=1e-3)
    legs = [
        next(leg.name for leg in ROBOT.legs if joint in leg.joints) for joint in trace.joint_names
    ]
    order = ("lf", "lm", "lr", "rf", "rm", "rr")
    middle = 0.5 * (trace.time[1:] + trace.time[:-1])
    down = walk.gait.feet_down(middle / period)[:, [order.index(leg) for leg in legs]]
    got = scheduled_phase_torque(trace, down)
    measured, moments = hp.results.phase_torques(trace), hp.results.joint_moments(trace)
    window = np.flatnonzero(trace.time > 2.0 * period - 1e-9)
    for j in range(len(legs)):
        stance = [k for k in window[:-1] if down[k, j]]
        square = sum(
            0.5 * (trace.torque[k, j] ** 2 + trace.torque[k + 1, j] ** 2) * sample for k in stance
        )
        assert got.rms[0, j] == pytest.approx(np.sqrt(square / (len(stance) * sample)), rel=1e-9)
        name = trace.joint_names[j]
        phases = measured.row(name, RETRACTION), measured.row(name, PROTRACTION)
        assert phases[0].share == pytest.approx(walk.gait.duty, abs=0.06)  # of measured forces
        peak = max(phase.moment_peak for phase in phases)
        assert peak == moments.moment[:, moments.joint(name)].max()
    femora = [j for j, name in enumerate(trace.joint_names) if "femur" in name]
    assert (got.rms[0, femora] > got.rms[1, femora]).all()  # legs carry the robot in stance
    with refused(ParameterError, "down", (2879, 18)):
        scheduled_phase_torque(trace, down[1:])


def test_the_stated_error_is_that_of_a_tenth_of_the_accuracy(found: hp.study.TorqueMap) -> None:
    """Of the slowest and the fastest point; of 1e-5 / 0.3, the loosest that `ndf` has."""
    check = found.check
    assert check is not None and check.accuracy == pytest.approx(1e-6 / 0.3)
    assert sorted(map(tuple, check.points)) == [(0, 1), (1, 0)]
    assert 0.0 < check.error("torque_rms") < 0.02
    assert check.error("cost_of_transport") < 0.01
    tight = hp.torque_map(
        SCENE, "arc", strokes=[0.06], cycle_times=[1.2], accuracy=check.accuracy, check=0
    ).torque_rms[0, 0]
    change = np.abs(found.torque_rms[0, 1] - tight).max() / tight.max()
    row = [tuple(p) for p in check.points].index((0, 1))
    column = check.quantities.index("torque_rms")
    assert check.change[row, column] == pytest.approx(change, rel=1e-9)
    with refused(UnknownNameError, kind="quantity", name="wobble"):
        check.error("wobble")


def test_a_point_that_cannot_be_walked_is_nan_with_its_reason() -> None:
    """Joints too fast, legs in each other's way, and a stroke longer than the legs."""
    got = hp.torque_map(
        SCENE, "arc", strokes=[0.05, 0.16, 0.5], cycle_times=[0.12, 0.9], accuracy=1e-3, check=0
    )
    assert "rad/s" in got.reason[0, 0] and "overlap" in got.reason[1, 1]
    assert "stroke of 0.5 m" in got.reason[2, 1] and "0.405" in got.reason[2, 1]
    assert got.reason[0, 1] == "" and np.isfinite(got.torque_peak[0, 1]).all()
    assert np.isnan(got.torque_peak[1:]).all() and np.isnan(got.cost_of_transport[0, 0])


def test_the_file_gives_every_bit_back(found: hp.study.TorqueMap, tmp_path: Path) -> None:
    import xarray

    path = found.save(tmp_path / "map.nc")
    assert hp.study.load_torque_map(path) == found
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data["torque_peak"].dims == ("stroke", "cycle_time", "joint")
        assert all(
            {"units", "long_name"} <= set(data[name].attrs) for name in schema(hp.study.TorqueMap)
        )
    assert found.run.scene == SCENE.to_toml() and "hexapod-pin" in found.run.versions
    with refused(ParameterError, "quantity", "mood"):
        write_torque_curves(found, tmp_path / "x.png", quantity="mood")
    with refused(UnknownNameError, kind="kind of joint", name="toe"):
        found.of_kind("torque_peak", "toe")
    with refused(TraceFileError, about=("hexapod_pin.torque_map", "hexapod_pin.gait_energy")):
        hp.study.load_gait_energy(path)


def alternating() -> hp.Trace:
    """Foot lm is down for 0.6 of each second, its femur then gives 2, else 1."""
    trace = synthetic_trace()
    down = np.mod(trace.time - 1e-9, 1.0) < 0.6
    force, torque = np.array(trace.foot_force), np.tile(np.arange(18.0), (len(trace.time), 1))
    force[~down, 1] = 0.0
    torque[:, JOINTS.index("lm_femur_joint")] = np.where(down, -2.0, 1.0)
    return replace(trace, foot_force=force, torque=torque)


def test_known_signals() -> None:
    found = hp.results.phase_torques(alternating())
    for phase, size, share in ((RETRACTION, 2.0, 0.6), (PROTRACTION, 1.0, 0.4)):
        row = found.row("lm_femur_joint", phase)
        assert (row.torque_peak, row.torque_p99, row.torque_rms) == pytest.approx((size,) * 3)
        assert row.share == pytest.approx(share, abs=1e-9)
        assert (row.foot, row.kind) == ("lm_foot", "femur")
    row = found.row("rr_tibia_joint", RETRACTION)
    assert (row.torque_peak, row.share) == pytest.approx((17.0, 1.0))
    absent = found.row("lf_coxa_joint", PROTRACTION)  # a phase that does not occur
    assert (absent.share, absent.torque_peak, absent.moment_rms) == (0.0, None, None)
    assert [row.joint for row in found.rows[::2]] == list(JOINTS)
    assert [row.foot for row in found.rows[::6]] == list(FEET)
    assert all(row.joint[:2] == row.foot[:2] for row in found.rows)
    known = ["retraction", "protraction"]
    with refused(UnknownNameError, kind="phase", name="swing", known=known):
        found.row("lm_femur_joint", "swing")
    with refused(UnknownNameError, kind="joint", name="knee"):
        found.row("knee", RETRACTION)


SCENES = {
    "s2": SCENE,
    "motors": hp.Scene(
        ROBOT,
        servo=hp.Servo(kp=240.0, kd=4.8, motor=hp.Motor(stall_torque=8.0, no_load_speed=10.0)),
    ),
}
GAITS = {"tripod": hp.Gait.tripod(), "wave 3/4": hp.Gait.wave(3 / 4)}
SPEEDS = (0.1, 0.16, 0.4)


@pytest.fixture(scope="module")
def energy() -> hp.study.GaitEnergy:
    return hp.study.gait_energy(SCENES, GAITS, SPEEDS, stroke=0.1, check=2)


def test_costs_are_those_of_each_walk(energy: hp.study.GaitEnergy) -> None:
    """To the bit: budget and summary of the same run; the electrical cost from samples, 2 %."""
    gait = GAITS["tripod"].with_changes(stroke=0.1, cycle_time=0.1 / (0.5 * 0.16), lift=0.02)
    duration, sample = walk_times(gait.cycle_time, 1)
    for scene, gamma in (("s2", 1.0), ("motors", 1.25)):
        trace = hp.simulate(
            SCENES[scene], hp.KinematicControl(gait), duration=duration, sample=sample,
            until="steady", accuracy=1e-4,
        )  # fmt: skip
        budget = hp.torque_budget(trace)
        assert energy.of("cost_of_transport", scene)[0, 1] == budget.cost_of_transport
        positive = energy.of("cost_of_transport_positive", scene)[0, 1]
        assert positive == budget.cost_of_transport_positive
        assert energy.of("measured_speed", scene)[0, 1] == budget.measured_speed
        steady = trace.time >= 2.0 * gait.cycle_time - 1e-9
        time, torque, rate = trace.time[steady], trace.torque[steady], trace.v[steady, 6:]
        square = np.trapezoid(torque**2, time, axis=0)
        work = np.trapezoid((torque * rate).sum(axis=1), time)
        distance = budget.distance
        electrical = (work + gamma * square.sum()) / (ROBOT.total_mass * 9.81 * distance)
        got = energy.of("cost_of_transport_electrical", scene)[0, 1]
        assert got == pytest.approx(electrical, rel=0.02)
        index = energy.of("torque_index", scene)[0, 1]
        assert index == pytest.approx(square.sum() / distance, rel=0.02)
        largest = energy.of("torque_index_largest", scene)[0, 1]
        assert largest == pytest.approx(square.max() / distance, rel=0.02)


def test_the_copper_loss_is_that_of_the_limits(energy: hp.study.GaitEnergy) -> None:
    """6 rad/s over 6 N m, *assumed*; and R / (k N)^2 of a motor given by its two end points."""
    np.testing.assert_allclose(energy.copper_loss, 1.0, rtol=1e-12)
    assert any("electrical loss" in text for text in energy.run.assumed)
    voltage, resistance, constant, gear = 12.0, 2.0, 0.012, 200.0
    motor = hp.Motor(
        stall_torque=voltage / resistance * constant * gear,
        no_load_speed=voltage / (constant * gear),
    )
    scene = hp.Scene(ROBOT, servo=hp.Servo(kp=240.0, kd=4.8, motor=motor))
    got = hp.study.gait_energy(scene, GAITS, [0.1], stroke=0.06, accuracy=1e-2, check=0).copper_loss
    np.testing.assert_allclose(got, resistance / (constant * gear) ** 2, rtol=1e-12)


def test_what_the_joints_cannot_follow_is_nan_with_its_reason(energy: hp.study.GaitEnergy) -> None:
    """Low duty is cheaper where all walk: the sign that Roy and Pratihar report, physics 2.5."""
    assert np.isnan(energy.cost_of_transport[:, 1, 2]).all()
    assert all("its limit is 6 rad/s" in text for text in energy.reason[:, 1, 2])
    assert (energy.reason[:, 0, :2] == "").all()
    assert energy.cheapest(scene="s2")[2].gaits in (("tripod",), ())
    test = energy.duty_test("cost_of_transport_positive", "s2")
    assert test is not None and test.low_is_cheaper
    assert test.speed == 0.16 and test.gaits == ("tripod", "wave 3/4")
    assert test.cost[0] < test.cost[1]


def test_gaits_walk_at_equal_speed_and_step_height(energy: hp.study.GaitEnergy) -> None:
    share = energy.measured_speed / np.array(SPEEDS)
    assert np.nanmax(np.abs(share - 1.0)) < 0.01
    np.testing.assert_allclose(energy.stroke[np.isfinite(energy.stroke)], 0.1, rtol=1e-12)
    how = {"cycle_time": 1.0, "accuracy": 1e-3, "check": 0}
    equal = hp.study.gait_energy(SCENES["s2"], GAITS, [0.08], **how)
    np.testing.assert_allclose(equal.stroke[0, :, 0], 0.08 * energy.duty, rtol=1e-12)
    assert equal.run.rule == "equal cycle time"


def test_ties_within_the_stated_error_are_listed() -> None:
    """Costs made up: 1 % apart with a stated error of 1 %, then of 0.1 %."""
    base = hp.study.gait_energy(SCENES["s2"], GAITS, [0.1], stroke=0.06, accuracy=1e-3, check=0)

    def altered(costs: np.ndarray, error: float) -> hp.study.GaitEnergy:
        point, names = np.zeros((1, 3), dtype=int), ("cost_of_transport",)
        check = AccuracyCheck(1e-4, point, names, [[error]])
        return replace(base, cost_of_transport=costs, check=check)

    costs = np.array([[[1.00], [1.01]]])
    for error, names in ((0.01, ("tripod", "wave 3/4")), (0.001, ("tripod",))):
        made = altered(costs, error)
        assert made.cheapest("cost_of_transport")[0].gaits == names
        assert made.tie("cost_of_transport") == pytest.approx(2.0 * error)
    test = altered(costs[:, ::-1], 0.001).duty_test("cost_of_transport")
    assert test is not None and not test.low_is_cheaper and test.duty == (0.5, 0.75)
    with refused(UnknownNameError, kind="cost", name="joy", known=list(COSTS)):
        base.cheapest("joy")


def test_one_file_holds_the_whole_study(energy: hp.study.GaitEnergy, tmp_path: Path) -> None:
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.8))
    parts = {"gait_energy": energy, "walk": hp.simulate(SCENES["s2"], walk, duration=0.1)}
    path = hp.study.write_study(tmp_path / "study.nc", parts)
    assert netcdf_groups(path) == tuple(sorted(parts))
    assert hp.study.load_study(path) == parts
    assert hp.study.load_gait_energy(energy.save(tmp_path / "alone.nc")) == energy
    with refused(TraceFileError, about=("alone.nc", "hexapod_pin.gait_energy")):
        hp.study.load_study(tmp_path / "alone.nc")
    with refused(ParameterError, "parts", "a/b"):
        hp.study.write_study(tmp_path / "no.nc", {"a/b": energy})
    assert "*" in energy.table("cost_of_transport", "s2").splitlines()[2]
    with refused(ParameterError, "costs", "joy"):
        write_gait_energy_figure(energy, tmp_path / "x.png", costs=["joy"])


def test_what_is_out_of_range_is_refused() -> None:
    for change, name, value in (
        ({"speeds": ()}, "speeds", ()), ({"gaits": {}}, "gaits", {}),
        ({"copper_loss": -1.0}, "copper_loss", -1.0),
        ({"stroke": 0.1, "cycle_time": 1.0}, "cycle_time", 1.0),
        ({"scenes": {"a": ROBOT}}, "gait_energy.scenes[a]", ROBOT),
    ):  # fmt: skip
        with refused(ParameterError, name, value):
            settings = {"scenes": SCENES, "gaits": GAITS, "speeds": SPEEDS, **change}
            hp.study.gait_energy(**settings)
    for name, value in (
        ("strokes", [0.1, 0.1]), ("cycle_times", [-1.0]), ("cycles", 0), ("walk", "moon"),
        ("accuracy", 3.0),
    ):  # fmt: skip
        settings = {"strokes": [0.1], "cycle_times": [1.0], name: value}
        with refused(ParameterError, name, value):
            hp.torque_map(SCENE, settings.pop("walk", "arc"), **settings)

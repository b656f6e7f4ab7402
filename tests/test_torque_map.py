"""Torque against stroke and cycle time: `hp.torque_map`, its phases, its file and its figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import FEET, JOINTS, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.errors import ParameterError, StudyInterrupted, TraceFileError, UnknownNameError
from hexapod_pin.results.grid_columns import NOT_RUN
from hexapod_pin.results.phase_torque import PROTRACTION, RETRACTION, scheduled_phase_torque
from hexapod_pin.results.schema import schema
from hexapod_pin.study.sweep.base_case import walk_times
from hexapod_pin.study.torque_map import PHASE_SAMPLES
from hexapod_pin.view import write_torque_curves

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
    assert (
        fractions == sorted(fractions)
        and len(fractions) == 6
        and fractions[-1] == pytest.approx(1.0)
    )
    return got


def arc(stroke: float, period: float) -> hp.motion.ArcWalk:
    """S2's walk with a stroke, from the closed form 2 R sin A."""
    return hp.motion.ArcWalk(
        hp.Gait.tetrapod(cycle_time=period), amplitude=float(np.arcsin(stroke / (2 * RADIUS)))
    )


def test_a_map_is_what_its_walks_come_to_one_by_one(found: hp.study.TorqueMap) -> None:
    """To the bit, with the same controller; the summary and its budget are computed alike."""
    for i, stroke in enumerate(STROKES):
        for j, period in enumerate(TIMES):
            radius = float(hp.motion.ArcWalk().path(ROBOT).radius.mean())
            walk = hp.motion.ArcWalk(
                hp.Gait.tetrapod(cycle_time=period),
                amplitude=float(np.arcsin(stroke / (2.0 * radius))),
            )
            duration, sample = walk_times(period, 1, PHASE_SAMPLES)
            trace = hp.simulate(
                SCENE, walk, duration=duration, until="steady", accuracy=1e-4, sample=sample
            )
            budget = hp.torque_budget(trace)
            rows = budget.joints
            assert found.torque_peak[i, j].tolist() == [row.torque_peak for row in rows]
            assert found.torque_p99[i, j].tolist() == [row.torque_p99 for row in rows]
            assert found.torque_rms[i, j].tolist() == [row.torque_rms for row in rows]
            assert found.speed_peak[i, j].tolist() == [row.speed_peak for row in rows]
            assert found.cost_of_transport[i, j] == budget.cost_of_transport
            assert found.normal_impulse[i, j].tolist() == trace.summary.normal_impulse.tolist()
            femur = found.of_kind("torque_peak", "femur")[i, j]
            assert femur == budget.kind("femur").peak.torque_peak
            energy = found.of_kind("positive_energy", "coxa")[i, j]
            assert energy == pytest.approx(budget.kind("coxa").positive_energy, rel=1e-12)


def test_the_stroke_of_an_arc_walk_is_the_one_requested(found: hp.study.TorqueMap) -> None:
    """V = stroke / (duty T); the amplitude from R as published agrees to its rounding, 1e-5."""
    expected = np.array(STROKES)[:, None] / (2.0 / 3.0 * np.array(TIMES))
    np.testing.assert_allclose(found.nominal_speed, expected, rtol=1e-12)
    assert arc(0.14, 1.2).path(ROBOT).speed == pytest.approx(expected[1, 1], rel=2e-5)


def test_feet_carry_the_weight(found: hp.study.TorqueMap) -> None:
    """Impulses of a periodic walk: weight times cycle time, but for the rise of its trunk."""
    weight = ROBOT.total_mass * 9.81
    total = found.normal_impulse.sum(axis=-1)
    np.testing.assert_allclose(total, np.broadcast_to(weight * np.array(TIMES), (2, 2)), rtol=1e-4)


def test_phases_part_the_window(found: hp.study.TorqueMap) -> None:
    """Times add up to the cycle, mean squares to that of the window; the duty is the gait's."""
    np.testing.assert_allclose(
        found.phase_time.sum(axis=2),
        np.broadcast_to(np.array(TIMES)[:, None], (2, 2, 18)),
        rtol=1e-12,
    )
    np.testing.assert_allclose(
        found.phase_time[:, :, 0], np.broadcast_to(2 / 3 * np.array(TIMES)[:, None], (2, 2, 18)),
        rtol=1e-9,
    )  # fmt: skip
    square = (found.phase_torque_rms**2 * found.phase_time).sum(axis=2) / np.array(TIMES)[:, None]
    missed = np.abs(square - found.torque_rms**2) * np.array(TIMES)[:, None]
    bound = (
        np.sqrt(found.phase_torque_rms**2 + missed[:, :, None] / found.phase_time)
        - found.phase_torque_rms
    )
    np.testing.assert_allclose(found.phase_torque_rms_error, bound, atol=1e-9)
    assert found.phase_torque_rms_error.max() < 0.02 * found.phase_torque_rms.max()
    # of samples, and of accepted states, which lie elsewhere: apart by what a peak falls in 1 ms
    np.testing.assert_allclose(found.phase_torque_peak.max(axis=2), found.torque_peak, rtol=2e-3)


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
    window = np.flatnonzero(trace.time > 2.0 * period - 1e-9)
    for j in range(len(legs)):
        stance = [k for k in window[:-1] if down[k, j]]
        square = sum(
            0.5 * (trace.torque[k, j] ** 2 + trace.torque[k + 1, j] ** 2) * sample for k in stance
        )
        assert got.rms[0, j] == pytest.approx(np.sqrt(square / (len(stance) * sample)), rel=1e-9)
    femora = [j for j, name in enumerate(trace.joint_names) if "femur" in name]
    assert (got.rms[0, femora] > got.rms[1, femora]).all()  # legs carry the robot in stance
    with refused(ParameterError, "down", (2879, 18)):
        scheduled_phase_torque(trace, down[1:])


def test_the_stated_error_is_that_of_a_tenth_of_the_accuracy(found: hp.study.TorqueMap) -> None:
    """Of two points, the slowest and the fastest; repeated by hand.

    A tenth of 1e-5 / 0.3, the loosest accuracy that makes a difference to a run of `ndf`.
    """
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
    assert check.change[row, check.quantities.index("torque_rms")] == pytest.approx(
        change, rel=1e-9
    )
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
    assert got.check is None and got.finished


def test_a_walk_of_ones_own_and_the_straight_one() -> None:
    """A factory that makes what "straight" makes gives the same bits."""
    settings = {"strokes": [0.06], "cycle_times": [0.9], "accuracy": 1e-3, "check": 0}

    def own(stroke: float, period: float) -> hp.KinematicControl:
        return hp.KinematicControl(hp.Gait.tripod(stroke=stroke, cycle_time=period))

    first = hp.torque_map(SCENE, own, **settings)
    second = hp.torque_map(SCENE, "straight", gait=hp.Gait.tripod(), **settings)
    assert (first.torque_rms == second.torque_rms).all()
    assert first.phase_time[0, 0, 0, 0] == pytest.approx(0.45, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("strokes", [], ()), ("strokes", [0.1, 0.1], ()), ("cycle_times", [-1.0], ()),
        ("cycles", 0, (1,)), ("check", -1, (0,)), ("walk", "moon", ()),
        ("accuracy", 3.0, (1e-12, 0.1)),
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_refused_before_anything_runs(
    name: str, value: object, allowed: tuple[float, ...]
) -> None:
    settings = {"strokes": [0.1], "cycle_times": [1.0], name: value}
    with refused(ParameterError, name, value, allowed=allowed):
        hp.torque_map(SCENE, settings.pop("walk", "arc"), **settings)


def test_an_interrupted_map_keeps_what_is_done() -> None:
    """Ctrl-C after the first point: the rest is marked as not run."""

    def stop(fraction: float) -> None:
        raise KeyboardInterrupt

    with refused(StudyInterrupted, about=("1", "2")) as caught:
        hp.torque_map(SCENE, strokes=[0.06], cycle_times=[0.8, 0.9], accuracy=1e-3, progress=stop)
    partial = caught.value.result
    assert not partial.finished and sorted(partial.reason[0]) == ["", NOT_RUN]
    assert np.isfinite(partial.torque_peak).all(axis=-1).sum() == 1


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
    with refused(TraceFileError, about=("hexapod_pin.torque_map", "hexapod_pin.gait_energy")):
        hp.study.load_gait_energy(path)


def test_unknown_quantities_are_refused(found: hp.study.TorqueMap, tmp_path: Path) -> None:
    """Figures are written in tests/test_s2_study.py."""
    with refused(ParameterError, "quantity", "mood"):
        write_torque_curves(found, tmp_path / "x.png", quantity="mood")
    with refused(UnknownNameError, kind="kind of joint", name="toe"):
        found.of_kind("torque_peak", "toe")


def test_legs_of_joints_are_those_of_the_robot() -> None:
    """The schedule's column of every joint: the leg that the URDF has it on."""
    from hexapod_pin.study.torque_map import _legs

    leg, legged = _legs(ROBOT)
    assert legged.all()
    names = [one.name for one in leg_group(ROBOT).legs]
    assert [names[k] for k in leg] == [joint.split("_")[0] for joint in ROBOT.joint_names]


# Torques of retraction and protraction: known signals, whole walks, names.


def alternating() -> hp.Trace:
    """Return a trace whose foot lm is down for 0.6 of each second; its femur then gives 2, else 1.

    All other joints give their number in the list.
    """
    trace = synthetic_trace()
    down = np.mod(trace.time - 1e-9, 1.0) < 0.6
    force, torque = np.array(trace.foot_force), np.tile(np.arange(18.0), (len(trace.time), 1))
    force[~down, 1] = 0.0
    torque[:, JOINTS.index("lm_femur_joint")] = np.where(down, -2.0, 1.0)
    return replace(trace, foot_force=force, torque=torque)


def test_known_signals() -> None:
    """Constant within a phase: peak, p99 and RMS are that constant; shares are 0.6 and 0.4."""
    found = hp.results.phase_torques(alternating())
    for phase, size, share in ((RETRACTION, 2.0, 0.6), (PROTRACTION, 1.0, 0.4)):
        row = found.row("lm_femur_joint", phase)
        assert (row.torque_peak, row.torque_p99, row.torque_rms) == pytest.approx((size,) * 3)
        assert row.share == pytest.approx(share, abs=1e-9)
        assert (row.foot, row.kind) == ("lm_foot", "femur")
    row = found.row("rr_tibia_joint", RETRACTION)
    assert (row.torque_peak, row.share) == pytest.approx((17.0, 1.0))


def test_a_phase_that_does_not_occur_has_no_numbers() -> None:
    found = hp.results.phase_torques(alternating())
    row = found.row("lf_coxa_joint", PROTRACTION)
    assert row.share == 0.0
    assert row.torque_peak is None and row.moment_rms is None
    assert " - " in next(
        x for x in found.table().splitlines() if x.startswith("lf_coxa_joint   protraction")
    )


def test_every_joint_belongs_to_its_leg() -> None:
    found = hp.results.phase_torques(alternating())
    assert [row.joint for row in found.rows[::2]] == list(JOINTS)
    assert [row.foot for row in found.rows[::6]] == list(FEET)
    for row in found.rows:
        assert row.joint[:2] == row.foot[:2]
        assert f"_{row.kind}_" in row.joint


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
def test_walk(name: str) -> None:
    """Stance bears the load: its femur peaks are larger; shares are near the duty; RMS add up."""
    gait = hp.Gait.tetrapod(stroke=0.1, cycle_time=1.2)
    scene = hp.Scene(hp.load_robot(name))
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=3.6)
    found, budget, moments = (
        hp.results.phase_torques(trace),
        hp.torque_budget(trace),
        hp.results.joint_moments(trace),
    )
    for leg in ("lf", "lm", "lr", "rf", "rm", "rr"):
        stance = found.row(f"{leg}_femur_joint", RETRACTION)
        swing = found.row(f"{leg}_femur_joint", PROTRACTION)
        assert stance.torque_rms > 1.5 * swing.torque_rms
        assert stance.share + swing.share == pytest.approx(1.0)
        # the planned lift is slow at first: feet leave the ground a little later than planned
        assert stance.share == pytest.approx(gait.duty, abs=0.06)
        assert stance.moment_peak >= stance.torque_peak * 0.95
        mean_square = sum(row.share * row.torque_rms**2 for row in (stance, swing))
        whole = budget.joint(f"{leg}_femur_joint").torque_rms
        assert np.sqrt(mean_square) == pytest.approx(whole, rel=0.01)  # gathered at steps
        j = moments.joint(f"{leg}_femur_joint")
        peak = max(stance.moment_peak, swing.moment_peak)
        assert peak == moments.moment[:, j].max()


def test_names_that_do_not_exist() -> None:
    found = hp.results.phase_torques(alternating())
    known = ["retraction", "protraction"]
    with refused(UnknownNameError, kind="phase", name="swing", known=known):
        found.row("lm_femur_joint", "swing")
    with refused(UnknownNameError, kind="joint", name="knee"):
        found.row("knee", RETRACTION)
    assert len(found.to_dict()["rows"]) == 36

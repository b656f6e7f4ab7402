"""Motors ranked for a robot: masses, rotors and lines in the simulation, and what is refused."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.results.motor_candidate import MotorCandidate
from hexapod_pin.results.motor_selection import write_selection_csv
from hexapod_pin.study.selection import motor_cases
from hexapod_pin.study.selection.motor_study import MotorChoice, candidates
from hexapod_pin.text_table import WIDTH

KINDS = ("coxa", "femur", "tibia")

STUDY = """
schema = 1
[base]
robot = "kharagpur"
gait = {name = "tripod", cycle_time = 1.2, stroke = 0.1}
accuracy = 1e-3
duration = 3.6
[motors]
voltage = 12.0
models = ["AX-12A", "XM430-W350", "MX-64", "MX-106", "XM540-W270"]
"""


@pytest.fixture(scope="module")
def selection():
    return hp.select_motors(STUDY, samples=0)


def test_passing_motors_come_first_and_the_lightest_of_them(selection):
    passes = [c.passes for c in selection.candidates]
    masses = [c.motor_mass for c in selection.candidates if c.passes]
    assert passes == sorted(passes, reverse=True) and masses == sorted(masses)
    for candidate in selection.candidates:
        record = candidate.motors["femur"]
        wanted = selection.total_mass + 18 * (record.mass - selection.contained)
        np.testing.assert_allclose(candidate.total_mass, wanted, rtol=1e-12)
    choice = selection.choice
    assert choice.passes and selection.iterations[-1].passes
    mass = 6 * sum(choice.motors[kind].mass for kind in KINDS)
    np.testing.assert_allclose(choice.motor_mass, mass)
    assert mass <= masses[0]
    femur = selection.candidate("AX-12A").use("femur")  # of S2's robot
    assert not femur.passes and femur.continuous_use > 1.0
    assert any("RMS torque" in r and "AX-12A at 12 V" in r for r in femur.reasons)


def test_uses_again_from_a_run_of_our_own(selection):
    """An independent path: the robot with the motors' masses as payloads, by the public parts."""
    record = load_catalog().get("XM540-W270", 12.0)
    robot = hp.load_robot("kharagpur")
    more = record.mass - selection.contained
    links = [f"{leg.name}_{part}" for leg in robot.legs for part in KINDS]
    motor = record.motor(0.9)
    servo = hp.Servo.for_robot(robot).model_copy(update={"motor": motor, "limited": False})
    loads = [hp.Payload(link, more) for link in links]
    gait = hp.Gait.tripod(cycle_time=1.2, stroke=0.1)
    scene = hp.Scene(robot, servo=servo, loads=loads)
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=3.6, accuracy=1e-3)
    femurs = [k for k, name in enumerate(trace.joint_names) if "femur" in name]
    rms = trace.summary.torque_rms[femurs].max()
    use = selection.candidate("XM540-W270").use("femur")
    np.testing.assert_allclose(use.continuous_use, rms / (0.2 * record.stall_torque), rtol=1e-9)
    speed = np.abs(trace.summary.speed_peak[femurs]).max()
    np.testing.assert_allclose(use.speed_use, speed / (0.9 * record.no_load_speed), rtol=1e-9)
    tau, rate = trace.torque[:, femurs], trace.v[:, 6:][:, femurs]
    line = 0.9 - np.sign(tau) * rate / record.no_load_speed
    inside = (trace.time >= trace.summary.start - 1e-9) & (trace.time <= trace.summary.end + 1e-9)
    sampled = (np.abs(tau) / (0.8 * record.stall_torque * line))[inside].max()
    assert sampled * (1.0 - 1e-9) <= use.peak_use < 1.02 * sampled  # peaks stand between samples


def test_the_answer_is_in_the_first_ten_lines(selection):
    """It stood on line 69 of 154, in lines of 154 characters."""
    lines = selection.lines()
    assert max(map(len, lines)) <= WIDTH and len(lines) <= 12
    assert lines[0].startswith(f"kharagpur: {selection.choice.name.split(',')[0]}")
    head = next(k for k, line in enumerate(lines) if "of 5 motors pass all joints of 1" in line)
    assert head < 3 and lines[head + 3].startswith(f"{selection.passing('femur')[0].name} ")


def test_a_file_of_all_uses(selection, tmp_path):
    assert len(json.loads(json.dumps(selection.to_dict(), allow_nan=False))["candidates"]) == 5
    path = write_selection_csv(selection, tmp_path / "m.csv")
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    first = next(r for r in rows if r["motor"] == "AX-12A" and r["kind of joint"] == "femur")
    use = selection.candidate("AX-12A").use("femur").continuous_use
    assert len(rows) == 15 and float(first["continuous [-]"]) == use


VARIED = """
vary = [
    {input = "payload", distribution = "uniform", low = 0.0, high = 6.0},
    {input = "mu", distribution = "uniform", low = 0.6, high = 0.61},
]
design = {kind = "sobol-indices", samples = 4, seed = 3}
"""


def test_confidence_counts_walks_and_names_what_decides():
    study = VARIED + STUDY.replace('"AX-12A", "XM430-W350", "MX-64", ', "")
    found = hp.select_motors(study).confidence
    assert found is not None and found.walks == 8 and len(found.values) == 8
    known = np.array([x for x in found.values if np.isfinite(x)])
    np.testing.assert_allclose(found.share, np.sum(known <= 1.0) / 8)
    assert found.low <= found.share <= found.high
    assert max(found.indices, key=found.indices.get) == "payload"
    assert "payload" in found.sentence and "confidence" in found.sentence


def test_a_choice_is_held_to_a_bus_a_maker_a_price_and_says_what_it_mixes():
    """MX-64 is made for both buses; an unpriced motor is not below any price."""
    rows = candidates(MotorChoice(buses=("rs-485",), voltage=12.0), Path()).records
    assert "MX-64" in {row.model for row in rows} and all("RS-485" in row.buses for row in rows)
    rows = candidates(MotorChoice(makers=("feetech", "HIWONDER"), dearest=20.0), Path()).records
    assert {row.model for row in rows} == {"STS3215", "SCS0009", "LX-16A", "LX-224"}
    for models, says in (
        (("MX-64", "XW540-T140", "XM430-W350"), ""),  # RS-485 is common to all
        (("AX-12A", "XW540-T140", "XM430-W350"), "mixes buses: coxa TTL, femur RS-485"),
        (("AX-12A", "STS3215-C018", "AX-12A"), "mixes makers: coxa ROBOTIS, femur Feetech"),
    ):
        motors = {k: load_catalog().get(m, 12.0) for k, m in zip(KINDS, models, strict=True)}
        assert says in "".join(mixed := MotorCandidate(motors, 3.0, 1.0, (), ()).mixed)
        assert len(mixed) == bool(says)


def test_options_of_the_command_are_the_study_s(run, tmp_path):
    for option, value, known in (("--bus", "I2C", "RS-485"), ("--maker", "Nobody", "Feetech")):
        done = run("select", "kharagpur", option, value)
        assert done.status == 2 and value in done.err and known in done.err
    done = run("select", "kharagpur", "--price-below", "1", "--bus", "TTL")
    assert done.status == 2 and "with a price" in done.err


def test_what_is_wrong_is_named():
    for line, name in (
        ('motors.voltage = "12"', "motors.voltage"), ("motors.volts = 12.0", "motors.volts"),
        ('motors.models = ["AX-12"]', "AX-12"), ("motors.voltage = 13.37", "13.37"),
        ('motors.catalog = "nowhere.csv"', "nowhere.csv"), ("derating.peak = 1.5", "derating.peak"),
        ("motors = 3", "motors"), ("design = 3", "design"),
    ):  # fmt: skip
        with pytest.raises(hp.errors.HexapodError) as found:
            hp.select_motors(f'schema = 1\n{line}\nbase = {{robot = "kharagpur"}}\n', samples=2)
        assert name in str(found.value)


# where motors sit ------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "mass"), [("kharagpur", 0.0167), ("athena", 0.185)])
def test_the_robot_is_heavier_by_the_difference(name, mass):
    robot = hp.load_robot(name)
    contained = motor_cases.assumed_motor_mass(robot)
    np.testing.assert_allclose(18 * contained, motor_cases.MOTOR_SHARE * robot.total_mass)
    masses = {"coxa": mass, "femur": 1.1 * mass, "tibia": mass}
    loads, notes = motor_cases.mass_loads(robot, masses, contained)
    total = hp.Scene(robot, loads=loads).total_mass
    wanted = robot.total_mass + 18 * (mass - contained) + 6 * 0.1 * mass
    np.testing.assert_allclose(total, wanted, rtol=1e-12)
    assert all("scaled down" in note for note in notes)


def test_a_motor_sits_on_the_axis_of_its_joint():
    robot = hp.load_robot("athena")
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.stand().q)
    for place in motor_cases.motor_places(robot):
        links = (model.getFrameId(n, pin.FrameType.BODY) for n in (place.moved, place.carrier))
        moved, carrier = (data.oMf[k] for k in links)
        np.testing.assert_allclose(carrier.act(place.position), moved.translation, atol=1e-14)


def test_masses_that_no_link_has_are_refused():
    robot = hp.load_robot("kharagpur")
    less, trunk = pytest.approx(6 * 0.29), ("base_link", "0")
    with refused(hp.errors.ParameterError, "motor_mass", less, allowed=(1.281,), about=trunk):
        motor_cases.mass_loads(robot, dict.fromkeys(("coxa", "femur", "tibia"), 0.01), 0.3)

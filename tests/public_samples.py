"""One of each type of data that the package's public names are, or give back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.interchange.servo_ticks import SERVOS
from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.link_shapes import trunk_points

QUICK: dict[str, Any] = {"duration": 0.9, "accuracy": 1e-2, "sample": 0.02}
"""How the walks are run: for what they are, not for their numbers."""

STUDY = """
schema = 1
[base]
robot = "kharagpur"
gait = { name = "tripod", stroke = 0.04, cycle_time = 0.3 }
duration = 0.9
method = "robust"
step = 2e-3
"""

VARIED = """
[[vary]]
input = "payload"
values = [0.0, 0.5]
"""

DRAWN = """
[[vary]]
input = "heading"
distribution = "uniform"
low = -1.0
high = 1.0
[[vary]]
input = "turn_rate"
distribution = "uniform"
low = -1.0
high = 1.0
[design]
kind = "sobol-indices"
samples = 16
seed = 3
"""

MOTORS = """
[motors]
voltage = 12.0
models = ["XM430-W350", "XM540-W270"]
"""


@cache
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


@cache
def scene() -> hp.Scene:
    heights = np.zeros((40, 40))
    heights[::3, ::4] = 1e-3
    ground = hp.HeightField.from_array(heights, spacing=0.1)
    return hp.Scene(robot(), terrain=ground, loads=[hp.Payload("base_link", mass=0.3)])


@cache
def walk() -> hp.KinematicControl:
    return hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))


@cache
def case() -> hp.Case:
    return hp.Case(scene(), walk(), **QUICK)


@cache
def trace() -> hp.Trace:
    return case().run()


@cache
def specs() -> tuple[Any, ...]:
    step = hp.motion.Step(start=0.1, end=0.2, initial=0.0, final=0.1)
    sine = hp.motion.Sine(amplitude=0.1, period=0.5)
    rates = {"mu_static": 0.7, "mu_dynamic": 0.5}
    sensors = hp.sensors.Sensors(q=hp.sensors.Sensor(noise=1e-3))
    return (
        hp.Contact.accurate(),
        hp.rl.RewardWeights(tilt=2.0),
        hp.rl.WalkTask(speed=(0.05, 0.1), sensors=sensors),
        hp.contact.HuntCrossley(stiffness=1e5),
        hp.contact.KelvinVoigt(stiffness=1e5, damping=10.0),
        hp.contact.Restitution(stiffness=1e5, restitution=0.3),
        hp.contact.AdamsImpact(stiffness=1e5, exponent=1.5, damping=10.0, damping_depth=1e-4),
        hp.contact.AdamsCoulomb(**rates, stiction_speed=0.01, transition_speed=0.02),
        hp.contact.BrownMcPhee(**rates, speed=0.01),
        hp.contact.SmoothStep(**rates, speed=0.01),
        hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
        hp.contact.TanhCoulomb(mu=0.7, slope=100.0),
        hp.Flat(height=0.1),
        hp.Slope(angle=0.1),
        hp.Stairs(rise=0.02, run=0.3, count=2),
        hp.terrain.Ramp(angle=0.1, run=1.0),
        hp.terrain.Groove(angle_left=0.1, angle_right=0.1),
        hp.terrain.Ledge(height=0.02),
        hp.terrain.ShakingGround(amplitude=0.01, frequency=2.0),
        hp.terrain.PatchedGround(
            ground=hp.Flat(), patches=(hp.terrain.Patch(low=(0.0, 0.0), high=(1.0, 1.0)),)
        ),
        hp.Motor(stall_torque=8.0, no_load_speed=10.0),
        hp.sizing.Derating(),
        hp.load_catalog().records[0],
        hp.LostLeg(leg="lf", start=0.1),
        hp.Push(link="base_link", start=0.1, duration=0.1, force=(1.0, 0.0, 0.0)),
        hp.loads.MassFactor(factor=1.1),
        hp.loads.RemovedMass(link="base_link", mass=0.1),
        hp.simulation.WorkLimits(),
        hp.foot_control.FootForceSensing(),
        hp.foot_control.Levelling(),
        hp.foot_control.SlipPid(),
        hp.foot_control.TouchDown(),
        hp.foot_control.VirtualSuspension(),
        hp.motion.BodyMotion(),
        hp.motion.VelocityCommand(time=(0.0, 1.0)),
        hp.motion.Step5(start=0.1, end=0.2, initial=0.0, final=0.1),
        hp.motion.Havsin(start=0.1, end=0.2, initial=0.0, final=0.1),
        hp.motion.VelocityStep(start=0.1, end=0.2, initial=0.0, final=0.1),
        hp.motion.Waypoints(time=(0.0, 1.0), value=(0.0, 0.1)),
        hp.motion.Hermite(time=(0.0, 1.0), value=(0.0, 0.1), rate=(0.0, 0.0)),
        hp.motion.Sum(terms=(step, sine)),
        hp.motion.Periodic(function=sine, period=0.5),
        KHARAGPUR,
    )


@cache
def controllers() -> tuple[Any, ...]:
    """Controllers; that with feedback has run, so that it holds what it made ready."""
    foot = hp.FootControl(
        walk().gait, slip=hp.foot_control.SlipPid(), levelling=hp.foot_control.Levelling()
    )
    hp.simulate(hp.Scene(robot()), foot, duration=0.05, accuracy=1e-2)
    motion = hp.motion.JointMotion(
        {"lf_coxa_joint": hp.motion.Step(start=0.1, end=0.2, initial=0.0, final=0.1)}
    )
    sent = hp.motion.SampledTrajectory([0.0, 0.1], np.stack([robot().posture] * 2))
    return (
        walk(),
        foot,
        hp.HoldPosture(),
        hp.FirmwareControl(
            walk(), hp.drive.Firmware(proportional=2.0), battery=hp.drive.Battery(voltage=12.0)
        ),
        hp.motion.ArcWalk(),
        motion,
        sent,
    )


def _sizing() -> list[Any]:
    demand, record = hp.sizing.joint_demand(trace()), hp.load_catalog().get("XM430-W350", 12.0)
    budget = hp.motor_budget(demand, record)
    return [
        demand, budget,
        hp.sizing.motor_ranking(demand, hp.load_catalog().records[:4]),
    ]  # fmt: skip


def _exchanged() -> list[Any]:
    with TemporaryDirectory() as folder:
        runs, model = Path(folder, "run.mcap"), Path(folder, "robot.xml")
        return [
            hp.interchange.ServoMount(1), SERVOS["dynamixel-x"],
            hp.interchange.read_mcap(hp.interchange.write_mcap(trace(), runs)),
            hp.interchange.read_mjcf(hp.interchange.write_mjcf(robot(), model, drawn=False)),
        ]  # fmt: skip


def _sweeps(folder: Path) -> list[Any]:
    study = hp.study.SweepStudy.from_toml(STUDY + VARIED)
    drawn = hp.study.SweepStudy.from_toml(STUDY + DRAWN)
    numbers = np.sin([drawn.point(k)["heading"] for k in range(len(drawn))])
    found = hp.study.uncertainty(drawn, {"y": numbers}, "y")
    flat, quick = hp.Scene(robot()), {"duration": 0.9, "method": "robust", "step": 2e-3}
    tuned = hp.tune(
        lambda values: hp.HoldPosture(np.array(robot().posture) + values["angle"]),
        start={"angle": 0.0}, bounds={"angle": (-0.05, 0.05)}, scenes={"flat": flat},
        objective=lambda runs, baseline: runs[0].height_mean, held_out={"high": scene()},
        seed=3, budget=16, duration=0.02, method="robust", step=2e-3,
    )  # fmt: skip
    return [
        study,
        hp.run_sweep(study, folder / "study.db"),
        found,
        hp.study.RelativeObjective({"height_rms": 1.0}),
        tuned,
        hp.compare({"a": flat}, {"a": walk(), "b": hp.HoldPosture()}, **quick),
        hp.study.gait_energy(
            flat, {"tripod": hp.Gait.tripod()}, [0.1], stroke=0.04, accuracy=1e-2, check=0
        ),
        hp.torque_map(flat, strokes=[0.04], cycle_times=[0.4], accuracy=1e-2, check=0),
        hp.select_motors(STUDY + MOTORS, samples=0),
    ]


def _results() -> list[Any]:
    session = hp.Session(scene(), accuracy=1e-2)
    return [
        session.checkpoint(),
        session.measure(),
        hp.feedback.Command(np.array(robot().posture)[None]),
        robot().stand(),
        hp.torque_budget(trace()),
        hp.stability(trace()),
        hp.results.joint_moments(trace()),
        hp.results.phase_torques(trace()),
        hp.walk_verdict(trace()),
        hp.study.WalkMetrics.of(trace().summary),
        hp.study.judge_peaks(case()),
        hp.simulation.amplification(scene(), walk(), duration=0.05),
        *hp.study.assumed_inputs(robot())[:1],
        *hp.simulate_batch([case()], keep="summary"),
    ]


def samples(folder: Path) -> list[Any]:
    """Return all of them; an empty folder is for the store of a sweep."""
    return [
        trace(), case(), trunk_points(robot()), scene().terrain.surface(),
        walk().plan(robot(), 1.0), walk().path(robot()), hp.load_catalog(),
        *specs(), *controllers(), *_results(), *_sizing(), *_exchanged(),
        *_sweeps(folder),
    ]  # fmt: skip


def within(value: Any, seen: set[int]) -> Iterator[Any]:
    """Yield the instances of this package's classes in a value, itself included."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, list | tuple):
        for one in value:
            yield from within(one, seen)
    elif isinstance(value, Mapping):
        yield from within(list(value.values()), seen)
    elif type(value).__module__.startswith("hexapod_pin"):
        yield value
        for name, one in getattr(value, "__dict__", {}).items():
            if not name.startswith("_"):
                yield from within(one, seen)

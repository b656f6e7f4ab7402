"""One of each type of data that the package's public names are, or give back."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.link_shapes import trunk_points

QUICK: dict[str, Any] = {"duration": 0.9, "accuracy": 1e-2}
"""How the walks are run: for what they are, not for their numbers."""

STUDY = """
schema = 1
[base]
robot = "kharagpur"
gait = { name = "tripod", stroke = 0.04, cycle_time = 0.3 }
duration = 0.9
accuracy = 1e-2
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
    """A packaged robot."""
    return hp.load_robot("kharagpur")


@cache
def scene() -> hp.Scene:
    """A scene with a load on an uneven ground."""
    heights = np.zeros((40, 40))
    heights[::3, ::4] = 1e-3
    ground = hp.HeightField.from_array(heights, spacing=0.1)
    return hp.Scene(robot(), terrain=ground, loads=[hp.Payload("base_link", mass=0.3)])


@cache
def walk() -> hp.KinematicControl:
    """A short walk."""
    return hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))


@cache
def case() -> hp.Case:
    """A walk on that ground."""
    return hp.Case(scene(), walk(), **QUICK)


@cache
def trace() -> hp.Trace:
    """What the walk left."""
    return case().run()


@cache
def specs() -> tuple[Any, ...]:
    """Parameter sets."""
    step = hp.Step(start=0.1, end=0.2, initial=0.0, final=0.1)
    sine = hp.Sine(amplitude=0.1, period=0.5)
    rates = {"mu_static": 0.7, "mu_dynamic": 0.5}
    sensors = hp.Sensors(q=hp.Sensor(noise=1e-3))
    return (
        hp.Contact.accurate(),
        hp.HuntCrossley(stiffness=1e5),
        hp.KelvinVoigt(stiffness=1e5, damping=10.0),
        hp.Restitution(stiffness=1e5, restitution=0.3),
        hp.AdamsImpact(stiffness=1e5, exponent=1.5, damping=10.0, damping_depth=1e-4),
        hp.AdamsCoulomb(**rates, stiction_speed=0.01, transition_speed=0.02),
        hp.BrownMcPhee(**rates, speed=0.01),
        hp.SmoothStep(**rates, speed=0.01),
        hp.StickSlip(mu=0.7, stiffness=2e4, damping=60.0),
        hp.TanhCoulomb(mu=0.7, slope=100.0),
        hp.Flat(height=0.1),
        hp.Slope(angle=0.1),
        hp.Stairs(rise=0.02, run=0.3, count=2),
        hp.Ramp(angle=0.1, run=1.0),
        hp.Groove(angle_left=0.1, angle_right=0.1),
        hp.Ledge(height=0.02),
        hp.ShakingGround(amplitude=0.01, frequency=2.0),
        scene().terrain,
        hp.PatchedGround(ground=hp.Flat(), patches=(hp.Patch(low=(0.0, 0.0), high=(1.0, 1.0)),)),
        hp.Patch(low=(0.0, 0.0), high=(1.0, 1.0)),
        scene().servos,
        scene().joint_stops,
        scene().loads[0],
        hp.Motor(stall_torque=8.0, no_load_speed=10.0),
        hp.Derating(),
        hp.load_catalog().records[0],
        hp.LostLeg(leg="lf", start=0.1),
        hp.Push(link="base_link", start=0.1, duration=0.1, force=(1.0, 0.0, 0.0)),
        hp.MassFactor(factor=1.1),
        hp.RemovedMass(link="base_link", mass=0.1),
        hp.WorkLimits(),
        hp.Sensor(noise=1e-3),
        sensors,
        hp.FootForceSensing(),
        hp.Levelling(),
        hp.SlipPid(),
        hp.TouchDown(),
        hp.VirtualSuspension(),
        walk().gait,
        hp.BodyMotion(),
        hp.VelocityCommand(time=(0.0, 1.0)),
        step,
        sine,
        hp.Step5(start=0.1, end=0.2, initial=0.0, final=0.1),
        hp.Havsin(start=0.1, end=0.2, initial=0.0, final=0.1),
        hp.Waypoints(time=(0.0, 1.0), value=(0.0, 0.1)),
        hp.Hermite(time=(0.0, 1.0), value=(0.0, 0.1), rate=(0.0, 0.0)),
        hp.Sum(terms=(step, sine)),
        hp.Periodic(function=sine, period=0.5),
        KHARAGPUR,
        KHARAGPUR.trunk,
        KHARAGPUR.coxa,
    )


@cache
def controllers() -> tuple[Any, ...]:
    """Controllers; that with feedback has run, so that it holds what it made ready."""
    foot = hp.FootControl(walk().gait, slip=hp.SlipPid(), levelling=hp.Levelling())
    hp.simulate(hp.Scene(robot()), foot, duration=0.05, accuracy=1e-2)
    motion = hp.JointMotion({"lf_coxa_joint": hp.Step(start=0.1, end=0.2, initial=0.0, final=0.1)})
    sent = hp.SampledTrajectory([0.0, 0.1], np.stack([robot().posture] * 2))
    return walk(), foot, hp.HoldPosture(), hp.ArcWalk(), motion, sent


def _sizing() -> list[Any]:
    """What joints need, and what motors give."""
    demand, record = hp.joint_demand(trace()), hp.load_catalog().get("XM430-W350", 12.0)
    budget = hp.motor_budget(demand, record)
    return [
        demand, budget, budget.joints[0], budget.battery,
        hp.motor_ranking(demand, hp.load_catalog().records[:4]),
    ]  # fmt: skip


def _sweeps(folder: Path) -> list[Any]:
    """What many cases come to."""
    study = hp.SweepStudy.from_toml(STUDY + VARIED)
    drawn = hp.SweepStudy.from_toml(STUDY + DRAWN)
    numbers = np.sin([drawn.point(k)["heading"] for k in range(len(drawn))])
    found = hp.uncertainty(drawn, {"y": numbers}, "y")
    flat, quick = hp.Scene(robot()), {"duration": 0.9, "accuracy": 1e-2}
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
        found.indices,
        hp.RelativeObjective({"height_rms": 1.0}),
        tuned,
        hp.compare({"flat": flat}, {"a": walk(), "b": hp.HoldPosture()}, **quick),
        hp.gait_energy(
            flat, {"tripod": hp.Gait.tripod()}, [0.1], stroke=0.04, accuracy=1e-2, check=0
        ),
        hp.torque_map(flat, strokes=[0.04], cycle_times=[0.4], accuracy=1e-2, check=0),
        hp.select_motors(STUDY + MOTORS, samples=0),
    ]


def _results() -> list[Any]:
    """What is read from a trace."""
    session = hp.Session(scene(), accuracy=1e-2)
    measured = session.measure()
    verdicts = hp.judge_peaks(case())
    return [
        trace(), trace().summary, trace().checkpoint, session.checkpoint(), measured,
        hp.Command(np.array(robot().posture)[None]), robot().stand(),
        hp.torque_budget(trace()), hp.stability(trace()), hp.joint_moments(trace()),
        hp.phase_torques(trace()), hp.walk_verdict(trace()), hp.WalkMetrics.of(trace().summary),
        verdicts, verdicts.joints[0],
        hp.amplification(scene(), walk(), duration=0.05),
        *hp.assumed_inputs(robot())[:1],
        *hp.simulate_batch([case()], keep="summary"),
    ]  # fmt: skip


def samples(folder: Path) -> list[Any]:
    """All of them.

    Args:
        folder: an empty one for the store of a sweep.
    """
    return [
        robot(), robot().legs[0], robot().feet[0], trunk_points(robot()), scene(), case(),
        scene().terrain.surface(), walk().plan(robot(), 1.0), walk().path(robot()),
        hp.load_catalog(), trace().error,
        *specs(), *controllers(), *_results(), *_sizing(), *_sweeps(folder),
    ]  # fmt: skip

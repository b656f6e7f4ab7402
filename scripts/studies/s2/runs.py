"""What is run for S2's study: its own simulation, what it is compared with, and both sweeps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import lru_cache
from math import asin
from pathlib import Path
from typing import TypeVar

from hexapod_pin.control.arc_path import StanceProfile
from hexapod_pin.control.arc_walk import ArcWalk, paper_motion
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import Controller
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.errors import SimulationInterrupted, StudyInterrupted
from hexapod_pin.ground.contact import Contact, HuntCrossley
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import StudyPart, load_study
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.batch import simulate_batch
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.gait_energy import SPEEDS, gait_energy
from hexapod_pin.study.torque_map import CYCLE_TIMES, STROKES, torque_map

STROKE = 0.14
"""Of S2's study [m]."""

DURATION, OUTPUT_SAMPLES = 10.0, 600
"""Of S2's simulation [s], and its output steps."""

SAMPLES_PER_OUTPUT = 5
"""Samples kept for each of S2's: 16.7 ms miss what touch-downs do."""

ACCURACY = 1e-5
"""Of all but the slow runs [m and rad]."""

SWEEP_ACCURACY = ACCURACY
"""Of both sweeps [m and rad]."""

SLOW_ACCURACY = 1e-8
"""Of the slow runs [m and rad]."""

RAMPS = {"ramp_2": 0.02, "ramp_5": 0.05, "paper": 0.1, "ramp_25": 0.25, "ramp_50": 0.5}
"""Share of each move in a ramp of the velocity [-], by the name of the walk; *assumed*."""

SLOW = 10.0
"""How many times S2's cycle time a quasi-static walk takes."""

LINEAR_STIFFNESS = 1e6
"""Of the linear contact of quasi-static walks: loads are shared as in statics [N/m], *assumed*."""

Part = TypeVar("Part", Trace, TorqueMap, GaitEnergy)
Bar = Callable[[str], AbstractContextManager[Callable[[float], None]]]


class PartsInterrupted(SimulationInterrupted):
    """Ctrl-C in the study; `.parts` holds what was done."""

    def __init__(self, parts: dict[str, StudyPart]) -> None:
        """Keep the parts."""
        super().__init__(f"interrupted; {len(parts)} parts are kept", None)
        self.parts = parts


def load_part(path: Path, name: str, kind: type[Part]) -> Part:
    """Return a part of a study's file.

    Raises:
        SystemExit: the file has no such part, or one of another kind.
    """
    part = _loaded(path, path.stat().st_mtime_ns).get(name)
    if not isinstance(part, kind):
        raise SystemExit(f"{path}: {name!r} is no {kind.__name__} of this study")
    return part


@lru_cache(maxsize=1)
def _loaded(path: Path, _changed: int) -> Mapping[str, StudyPart]:
    """Return the parts of a study's file, read once until it changes."""
    return load_study(path)


def study_scene(robot: Robot) -> Scene:
    """Return S2's scene: IMPACT and friction of its figure 4, motions prescribed."""
    return Scene(robot, contact=Contact.preset("s2"), prescribed=True)


def energy_scenes(robot: Robot) -> dict[str, Scene]:
    """Return the scenes of the energy of gaits by drive and contact: servos on three contacts."""
    scenes = {
        f"servo, {name}": Scene(robot, contact=Contact.preset(name))
        for name in ("s2", "s1", "accurate")
    }
    return {**scenes, "prescribed, s2": study_scene(robot)}


def slow_gaits() -> dict[str, Gait]:
    """Return the gaits of the static envelope at a tenth of S2's speed, by name."""
    period = SLOW * Gait.tetrapod().cycle_time
    return {
        "slow_tripod": Gait.tripod(cycle_time=period),
        "slow_tetrapod": Gait.tetrapod(cycle_time=period),
        "slow_wave_2_3": Gait.wave(2 / 3, cycle_time=period),
        "slow_wave_5_6": Gait.wave(5 / 6, cycle_time=period),
    }


def study_cases() -> dict[str, Case]:
    """Return the single runs of the study by name."""
    robot = load_robot("kharagpur")
    scene, sample = study_scene(robot), DURATION / OUTPUT_SAMPLES / SAMPLES_PER_OUTPUT
    linear = Contact(
        normal=HuntCrossley(stiffness=LINEAR_STIFFNESS, exponent=1.0, dissipation=100.0),
        friction=scene.contact.friction,
    )
    walks: dict[str, tuple[Scene, Controller]] = {
        **{
            name: (scene, paper_motion(robot, stroke=STROKE, ramp_share=share))
            for name, share in RAMPS.items()
        },
        "step": (scene, paper_motion(robot, stroke=STROKE, profile="step")),
        "paper_servo": (replace(scene, prescribed=False), paper_walk(robot, STROKE, 2.4)),
        "constant": (scene, paper_motion(robot, stroke=STROKE, profile="constant")),
        "straight": (scene, KinematicControl(Gait.tetrapod(stroke=STROKE))),
    }
    cases = {
        name: Case(*walk, duration=DURATION, accuracy=ACCURACY, sample=sample)
        for name, walk in walks.items()
    }
    for name, gait in slow_gaits().items():
        cases[name] = Case(
            replace(scene, contact=linear), arc_walk(robot, STROKE, gait), method="ndf",
            accuracy=SLOW_ACCURACY, duration=3.0 * gait.cycle_time,
            sample=gait.cycle_time / OUTPUT_SAMPLES,
        )  # fmt: skip
    return cases


def study_parts(bar: Bar, *, threads: int = 2, every: int = 1) -> dict[str, StudyPart]:
    """Run the whole study and return its parts by the names of their groups.

    Args:
        bar: gives a progress callable for a title.
        threads: how many runs at a time.
        every: of each axis of the sweeps only every N-th value, for a quick look.

    Raises:
        PartsInterrupted: Ctrl-C; `.parts` holds what was done.
    """
    parts: dict[str, StudyPart] = {}
    scene, cases = study_scene(load_robot("kharagpur")), study_cases()

    def paper(stroke: float, cycle_time: float) -> ArcWalk:  # the map is named after it
        return paper_walk(scene.robot, stroke, cycle_time)

    try:
        with bar("S2's simulation") as progress:
            parts |= _traces(cases, simulate_batch(
                cases.values(), threads=threads, errors="raise", progress=progress
            ))  # fmt: skip
        with bar("stroke and cycle time") as progress:
            parts["torque_map"] = torque_map(
                scene,
                paper,
                strokes=STROKES[::-every][::-1], cycle_times=CYCLE_TIMES[::-every][::-1],
                accuracy=SWEEP_ACCURACY, threads=threads, progress=progress,
            )  # fmt: skip
        with bar("energy against speed") as progress:
            parts["gait_energy"] = gait_energy(
                energy_scenes(scene.robot),
                speeds=SPEEDS[::every], accuracy=SWEEP_ACCURACY, threads=threads, progress=progress,
            )  # fmt: skip
    except StudyInterrupted as stop:
        name = "gait_energy" if "torque_map" in parts else "torque_map"
        raise PartsInterrupted({**parts, name: stop.result}) from None
    except SimulationInterrupted as stop:
        raise PartsInterrupted(parts | _traces(cases, stop.results or [])) from None
    except KeyboardInterrupt:
        raise PartsInterrupted(parts) from None
    return parts


def _traces(cases: Mapping[str, Case], results: Sequence[object]) -> dict[str, StudyPart]:
    """Return the traces among the results of a batch by the names of its cases."""
    return {name: one for name, one in zip(cases, results, strict=False) if isinstance(one, Trace)}


def paper_walk(robot: Robot, stroke: float, cycle_time: float) -> ArcWalk:
    """Return S2's walk with a stroke [m] and a cycle time [s]: STEPs of the joints' velocities."""
    return arc_walk(robot, stroke, Gait.tetrapod(cycle_time=cycle_time), "velocity-step")


def arc_walk(
    robot: Robot, stroke: float, gait: Gait, profile: StanceProfile = "constant"
) -> ArcWalk:
    """Return a walk on arcs with a stroke [m]."""
    amplitude = asin(stroke / (2.0 * float(ArcWalk().path(robot).radius.mean())))
    return ArcWalk(gait, amplitude=amplitude, profile=profile)

"""The public names of the package by room: what is promised to its users.

A name that is added, moved or taken away is a change of this list.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from operator import attrgetter
from typing import Any

import hexapod_pin

MODULES = """
contact drive errors feedback foot_control interchange loads motion results rl robot sensors
simulation
sizing study terrain view
""".split()
"""Rooms, and the modules of errors and of figures and playback."""

SURFACE: Mapping[str, str] = {
    "": """
        Blueprint Case compare Contact FirmwareControl Flat FootControl Gait HeightField HoldPosture
        JointStops KinematicControl load_case load_catalog load_robot load_summary load_sweep
        load_trace LostLeg Motor motor_budget Payload Push register_controller Robot run_study
        run_sweep Scene
        select_motors Servo Session simulate simulate_batch Slope stability Stairs State Summary
        torque_budget torque_map Trace tune urdf_path walk_verdict
    """,
    "contact": """
        AdamsCoulomb AdamsImpact BrownMcPhee HuntCrossley KelvinVoigt Restitution SmoothStep
        StickSlip TanhCoulomb
    """,
    "terrain": """
        Groove Ledge Patch PatchedGround Ramp ShakingGround study_grounds
    """,
    "motion": """
        ArcWalk BodyMotion default_gait fit_gait Havsin Hermite JointMotion least_torque_posture
        paper_motion Periodic posture_cost SampledTrajectory Sine Step Step5 Sum VelocityCommand
        VelocityStep Waypoints
    """,
    "sensors": """
        Sensor Sensors
    """,
    "feedback": """
        Command FeedbackController Measurement
    """,
    "foot_control": """
        FootForceSensing Levelling SlipPid TouchDown VirtualSuspension
    """,
    "interchange": """
        BusServo McapRecording MjcfRobot read_mcap read_mjcf ServoMount write_joint_trajectory
        write_mcap write_mjcf write_servo_ticks
    """,
    "loads": """
        MassFactor RemovedMass
    """,
    "sizing": """
        BatteryLoad Catalog Derating joint_demand JointDemand motor_ranking MotorBudget MotorRanking
        MotorRecord MotorUse
    """,
    "study": """
        assumed_inputs Comparison gait_energy GaitEnergy judge_peaks load_gait_energy load_study
        load_torque_map MotorSelection open_sweep PeakVerdict PeakVerdicts RelativeObjective
        SweepResult SweepStudy TorqueMap TuningResult Uncertainty uncertainty WalkMetrics
        write_study
    """,
    "results": """
        Checkpoint joint_moments JointMoments phase_torques PhaseTorques Stability TorqueBudget
        WalkVerdict
    """,
    "simulation": """
        Amplification amplification iterate_batch WorkLimits
    """,
    "rl": """
        RewardWeights WalkEnv WalkTask WalkVectorEnv
    """,
    "robot": """
        Segment Trunk
    """,
}
"""Names by the room in which they are found, "" for `hp` itself."""


@cache
def surface() -> Mapping[str, Any]:
    """Return what each public name stands for, by dotted name such as "contact.StickSlip"."""
    dotted = [".".join(filter(None, (room, n))) for room, ns in SURFACE.items() for n in ns.split()]
    return {name: attrgetter(name)(hexapod_pin) for name in dotted}

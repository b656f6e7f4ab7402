"""Walk a hexapod's URDF on compliant feet; torque of every joint, and how far to trust it.

Names are imported when they are first used, so that `import hexapod_pin` stays quick.

Example:
    >>> import hexapod_pin as hp
    >>> robot = hp.load_robot("kharagpur")
    >>> gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
    >>> trace = hp.simulate(hp.Scene(robot), hp.KinematicControl(gait), duration=10.0)
    >>> print(hp.torque_budget(trace).table())
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hexapod_pin import errors as errors
    from hexapod_pin import view as view
    from hexapod_pin.control.arc_walk import ArcWalk as ArcWalk
    from hexapod_pin.control.arc_walk import paper_motion as paper_motion
    from hexapod_pin.control.body_motion import BodyMotion as BodyMotion
    from hexapod_pin.control.commanded_body import VelocityCommand as VelocityCommand
    from hexapod_pin.control.curves import Havsin as Havsin
    from hexapod_pin.control.curves import Hermite as Hermite
    from hexapod_pin.control.curves import Sine as Sine
    from hexapod_pin.control.curves import Step as Step
    from hexapod_pin.control.curves import Step5 as Step5
    from hexapod_pin.control.curves import Waypoints as Waypoints
    from hexapod_pin.control.feedback import Command as Command
    from hexapod_pin.control.feedback import FeedbackController as FeedbackController
    from hexapod_pin.control.feedback import Measurement as Measurement
    from hexapod_pin.control.foot_control import FootControl as FootControl
    from hexapod_pin.control.foot_control import FootForceSensing as FootForceSensing
    from hexapod_pin.control.foot_control import Levelling as Levelling
    from hexapod_pin.control.foot_control import SlipPid as SlipPid
    from hexapod_pin.control.foot_control import TouchDown as TouchDown
    from hexapod_pin.control.foot_control import VirtualSuspension as VirtualSuspension
    from hexapod_pin.control.gait import Gait as Gait
    from hexapod_pin.control.joint_motion import JointMotion as JointMotion
    from hexapod_pin.control.kinematic import KinematicControl as KinematicControl
    from hexapod_pin.control.registry import register_controller as register_controller
    from hexapod_pin.control.sampled_trajectory import HoldPosture as HoldPosture
    from hexapod_pin.control.sampled_trajectory import SampledTrajectory as SampledTrajectory
    from hexapod_pin.control.sensors import Sensor as Sensor
    from hexapod_pin.control.sensors import Sensors as Sensors
    from hexapod_pin.control.time_function import Periodic as Periodic
    from hexapod_pin.control.time_function import Sum as Sum
    from hexapod_pin.drive.catalog import Catalog as Catalog
    from hexapod_pin.drive.catalog import MotorRecord as MotorRecord
    from hexapod_pin.drive.catalog import load_catalog as load_catalog
    from hexapod_pin.drive.catalog.motor_record import Derating as Derating
    from hexapod_pin.drive.joint_stops import JointStops as JointStops
    from hexapod_pin.drive.motor import Motor as Motor
    from hexapod_pin.drive.servo import Servo as Servo
    from hexapod_pin.ground.contact import AdamsCoulomb as AdamsCoulomb
    from hexapod_pin.ground.contact import AdamsImpact as AdamsImpact
    from hexapod_pin.ground.contact import BrownMcPhee as BrownMcPhee
    from hexapod_pin.ground.contact import Contact as Contact
    from hexapod_pin.ground.contact import HuntCrossley as HuntCrossley
    from hexapod_pin.ground.contact import KelvinVoigt as KelvinVoigt
    from hexapod_pin.ground.contact import Restitution as Restitution
    from hexapod_pin.ground.contact import SmoothStep as SmoothStep
    from hexapod_pin.ground.contact import StickSlip as StickSlip
    from hexapod_pin.ground.contact import TanhCoulomb as TanhCoulomb
    from hexapod_pin.ground.terrain import Flat as Flat
    from hexapod_pin.ground.terrain import Groove as Groove
    from hexapod_pin.ground.terrain import HeightField as HeightField
    from hexapod_pin.ground.terrain import Ledge as Ledge
    from hexapod_pin.ground.terrain import Patch as Patch
    from hexapod_pin.ground.terrain import PatchedGround as PatchedGround
    from hexapod_pin.ground.terrain import Ramp as Ramp
    from hexapod_pin.ground.terrain import ShakingGround as ShakingGround
    from hexapod_pin.ground.terrain import Slope as Slope
    from hexapod_pin.ground.terrain import Stairs as Stairs
    from hexapod_pin.ground.terrain import study_grounds as study_grounds
    from hexapod_pin.results.checkpoint import Checkpoint as Checkpoint
    from hexapod_pin.results.comparison import Comparison as Comparison
    from hexapod_pin.results.gait_energy import GaitEnergy as GaitEnergy
    from hexapod_pin.results.gait_energy import load_gait_energy as load_gait_energy
    from hexapod_pin.results.joint_moments import JointMoments as JointMoments
    from hexapod_pin.results.joint_moments import joint_moments as joint_moments
    from hexapod_pin.results.motor_selection import MotorSelection as MotorSelection
    from hexapod_pin.results.peak_verdict import PeakVerdict as PeakVerdict
    from hexapod_pin.results.peak_verdict import PeakVerdicts as PeakVerdicts
    from hexapod_pin.results.phase_torque import PhaseTorques as PhaseTorques
    from hexapod_pin.results.phase_torque import phase_torques as phase_torques
    from hexapod_pin.results.sizing import BatteryLoad as BatteryLoad
    from hexapod_pin.results.sizing import JointDemand as JointDemand
    from hexapod_pin.results.sizing import MotorBudget as MotorBudget
    from hexapod_pin.results.sizing import MotorRanking as MotorRanking
    from hexapod_pin.results.sizing import MotorUse as MotorUse
    from hexapod_pin.results.sizing.motor_budget import motor_budget as motor_budget
    from hexapod_pin.results.sizing.motor_budget import motor_ranking as motor_ranking
    from hexapod_pin.results.sizing.trace_demand import joint_demand as joint_demand
    from hexapod_pin.results.stability import Stability as Stability
    from hexapod_pin.results.stability import stability as stability
    from hexapod_pin.results.summary import Summary as Summary
    from hexapod_pin.results.summary import load_summary as load_summary
    from hexapod_pin.results.torque_budget import TorqueBudget as TorqueBudget
    from hexapod_pin.results.torque_budget import torque_budget as torque_budget
    from hexapod_pin.results.torque_map import TorqueMap as TorqueMap
    from hexapod_pin.results.torque_map import load_torque_map as load_torque_map
    from hexapod_pin.results.trace import Trace as Trace
    from hexapod_pin.results.trace_file import load_study as load_study
    from hexapod_pin.results.trace_file import load_trace as load_trace
    from hexapod_pin.results.trace_file import write_study as write_study
    from hexapod_pin.results.walk_metrics import WalkMetrics as WalkMetrics
    from hexapod_pin.results.walk_verdict import WalkVerdict as WalkVerdict
    from hexapod_pin.results.walk_verdict import walk_verdict as walk_verdict
    from hexapod_pin.robot.description.blueprint import Blueprint as Blueprint
    from hexapod_pin.robot.description.blueprint import Segment as Segment
    from hexapod_pin.robot.description.blueprint import Trunk as Trunk
    from hexapod_pin.robot.robot import Robot as Robot
    from hexapod_pin.robot.robot import load_robot as load_robot
    from hexapod_pin.robot.robot import urdf_path as urdf_path
    from hexapod_pin.robot.state import State as State
    from hexapod_pin.scene.loads import LostLeg as LostLeg
    from hexapod_pin.scene.loads import MassFactor as MassFactor
    from hexapod_pin.scene.loads import Payload as Payload
    from hexapod_pin.scene.loads import Push as Push
    from hexapod_pin.scene.loads import RemovedMass as RemovedMass
    from hexapod_pin.scene.scene import Scene as Scene
    from hexapod_pin.simulation.amplification import Amplification as Amplification
    from hexapod_pin.simulation.amplification import amplification as amplification
    from hexapod_pin.simulation.batch import iterate_batch as iterate_batch
    from hexapod_pin.simulation.batch import simulate_batch as simulate_batch
    from hexapod_pin.simulation.case import Case as Case
    from hexapod_pin.simulation.case import load_case as load_case
    from hexapod_pin.simulation.case import simulate as simulate
    from hexapod_pin.simulation.run_settings import WorkLimits as WorkLimits
    from hexapod_pin.simulation.session import Session as Session
    from hexapod_pin.sweep.assumed_inputs import assumed_inputs as assumed_inputs
    from hexapod_pin.sweep.compare import compare as compare
    from hexapod_pin.sweep.gait_energy import gait_energy as gait_energy
    from hexapod_pin.sweep.judge_peaks import judge_peaks as judge_peaks
    from hexapod_pin.sweep.runs.run_sweep import run_sweep as run_sweep
    from hexapod_pin.sweep.runs.sweep_result import SweepResult as SweepResult
    from hexapod_pin.sweep.runs.sweep_result import open_sweep as open_sweep
    from hexapod_pin.sweep.selection import select_motors as select_motors
    from hexapod_pin.sweep.study import SweepStudy as SweepStudy
    from hexapod_pin.sweep.study import load_sweep as load_sweep
    from hexapod_pin.sweep.torque_map import torque_map as torque_map
    from hexapod_pin.sweep.tuning import tune as tune
    from hexapod_pin.sweep.tuning_result import RelativeObjective as RelativeObjective
    from hexapod_pin.sweep.tuning_result import TuningResult as TuningResult
    from hexapod_pin.sweep.uncertainty import Uncertainty as Uncertainty
    from hexapod_pin.sweep.uncertainty import uncertainty as uncertainty

    __version__: str

_MODULES = {
    "AdamsCoulomb": "ground.contact",
    "AdamsImpact": "ground.contact",
    "Amplification": "simulation.amplification",
    "ArcWalk": "control.arc_walk",
    "BatteryLoad": "results.sizing",
    "Blueprint": "robot.description.blueprint",
    "BodyMotion": "control.body_motion",
    "BrownMcPhee": "ground.contact",
    "Case": "simulation.case",
    "Catalog": "drive.catalog",
    "Checkpoint": "results.checkpoint",
    "Command": "control.feedback",
    "Comparison": "results.comparison",
    "Contact": "ground.contact",
    "Derating": "drive.catalog.motor_record",
    "FeedbackController": "control.feedback",
    "Flat": "ground.terrain",
    "FootControl": "control.foot_control",
    "FootForceSensing": "control.foot_control",
    "Gait": "control.gait",
    "GaitEnergy": "results.gait_energy",
    "Groove": "ground.terrain",
    "Havsin": "control.curves",
    "HeightField": "ground.terrain",
    "Hermite": "control.curves",
    "HoldPosture": "control.sampled_trajectory",
    "HuntCrossley": "ground.contact",
    "JointDemand": "results.sizing",
    "JointMoments": "results.joint_moments",
    "JointMotion": "control.joint_motion",
    "JointStops": "drive.joint_stops",
    "KelvinVoigt": "ground.contact",
    "KinematicControl": "control.kinematic",
    "Ledge": "ground.terrain",
    "Levelling": "control.foot_control",
    "LostLeg": "scene.loads",
    "Measurement": "control.feedback",
    "Motor": "drive.motor",
    "MotorSelection": "results.motor_selection",
    "select_motors": "sweep.selection",
    "MotorBudget": "results.sizing",
    "MotorRanking": "results.sizing",
    "motor_ranking": "results.sizing",
    "MotorUse": "results.sizing",
    "MotorRecord": "drive.catalog",
    "Patch": "ground.terrain",
    "PatchedGround": "ground.terrain",
    "MassFactor": "scene.loads",
    "Payload": "scene.loads",
    "RemovedMass": "scene.loads",
    "PeakVerdict": "results.peak_verdict",
    "PeakVerdicts": "results.peak_verdict",
    "Periodic": "control.time_function",
    "PhaseTorques": "results.phase_torque",
    "Push": "scene.loads",
    "Ramp": "ground.terrain",
    "RelativeObjective": "sweep.tuning_result",
    "Restitution": "ground.contact",
    "Robot": "robot.robot",
    "SampledTrajectory": "control.sampled_trajectory",
    "Scene": "scene.scene",
    "Segment": "robot.description.blueprint",
    "Sensor": "control.sensors",
    "Sensors": "control.sensors",
    "Servo": "drive.servo",
    "Session": "simulation.session",
    "ShakingGround": "ground.terrain",
    "Sine": "control.curves",
    "SlipPid": "control.foot_control",
    "Slope": "ground.terrain",
    "SmoothStep": "ground.contact",
    "Stability": "results.stability",
    "Stairs": "ground.terrain",
    "State": "robot.state",
    "Step": "control.curves",
    "Step5": "control.curves",
    "StickSlip": "ground.contact",
    "Sum": "control.time_function",
    "Summary": "results.summary",
    "SweepResult": "sweep.runs.sweep_result",
    "SweepStudy": "sweep.study",
    "TanhCoulomb": "ground.contact",
    "TorqueBudget": "results.torque_budget",
    "TorqueMap": "results.torque_map",
    "TouchDown": "control.foot_control",
    "Trace": "results.trace",
    "Trunk": "robot.description.blueprint",
    "TuningResult": "sweep.tuning_result",
    "Uncertainty": "sweep.uncertainty",
    "VelocityCommand": "control.commanded_body",
    "VirtualSuspension": "control.foot_control",
    "WalkMetrics": "results.walk_metrics",
    "WalkVerdict": "results.walk_verdict",
    "Waypoints": "control.curves",
    "assumed_inputs": "sweep.assumed_inputs",
    "compare": "sweep.compare",
    "gait_energy": "sweep.gait_energy",
    "WorkLimits": "simulation.run_settings",
    "amplification": "simulation.amplification",
    "iterate_batch": "simulation.batch",
    "joint_demand": "results.sizing",
    "joint_moments": "results.joint_moments",
    "judge_peaks": "sweep.judge_peaks",
    "load_case": "simulation.case",
    "load_catalog": "drive.catalog",
    "load_gait_energy": "results.gait_energy",
    "load_robot": "robot.robot",
    "load_study": "results.trace_file",
    "load_summary": "results.summary",
    "load_sweep": "sweep.study",
    "load_torque_map": "results.torque_map",
    "load_trace": "results.trace_file",
    "motor_budget": "results.sizing",
    "open_sweep": "sweep.runs.sweep_result",
    "paper_motion": "control.arc_walk",
    "phase_torques": "results.phase_torque",
    "register_controller": "control.registry",
    "run_sweep": "sweep.runs.run_sweep",
    "simulate": "simulation.case",
    "simulate_batch": "simulation.batch",
    "stability": "results.stability",
    "study_grounds": "ground.terrain",
    "torque_budget": "results.torque_budget",
    "torque_map": "sweep.torque_map",
    "tune": "sweep.tuning",
    "uncertainty": "sweep.uncertainty",
    "urdf_path": "robot.robot",
    "walk_verdict": "results.walk_verdict",
    "write_study": "results.trace_file",
}

_FORMER = {
    "Held": "control.sampled_trajectory.SampledTrajectory",
    "Hold": "control.sampled_trajectory.HoldPosture",
    "Patched": "ground.terrain.PatchedGround",
    "Shaken": "ground.terrain.ShakingGround",
    "advise": "benchmark.advice.advise",
    "playback": "view",
}
"""Names of 0.1 and what they are now."""

__all__ = ["__version__", "errors", "view", *_MODULES]  # noqa: PLE0604


if not TYPE_CHECKING:  # with it, a type checker would take any name for granted

    def __getattr__(name: str) -> Any:
        """Import a public name on first use (PEP 562)."""
        if name == "__version__":
            from importlib.metadata import version

            value: Any = version("hexapod-pin")
        elif name in ("errors", "view"):
            value = import_module(f"hexapod_pin.{name}")
        elif name in _MODULES:
            value = getattr(import_module(f"hexapod_pin.{_MODULES[name]}"), name)
        elif name in _FORMER:
            return _former(name)
        else:
            raise AttributeError(f"module 'hexapod_pin' has no attribute {name!r}")
        globals()[name] = value
        return value


def _former(name: str) -> Any:
    """Return what a former name is called now, with a warning that says so."""
    import warnings

    now = _FORMER[name]
    warnings.warn(f"hexapod_pin.{name} is now hexapod_pin.{now}", DeprecationWarning, stacklevel=3)
    module, _, attribute = now.rpartition(".")
    if not module:
        return import_module(f"hexapod_pin.{now}")
    return getattr(import_module(f"hexapod_pin.{module}"), attribute)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)

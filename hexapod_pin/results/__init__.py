"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.energy_margin import nesm
from hexapod_pin.results.gait_energy import GaitEnergy, load_gait_energy
from hexapod_pin.results.joint_moments import JointMoments, joint_moments
from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
from hexapod_pin.results.phase_torque import PhaseTorques, phase_torques
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.sizing import (
    BatteryLoad,
    JointDemand,
    MotorBudget,
    MotorRanking,
    MotorUse,
    joint_demand,
    motor_budget,
    motor_ranking,
)
from hexapod_pin.results.stability import Stability, stability
from hexapod_pin.results.study_file import load_study, write_study
from hexapod_pin.results.summary import Summary, load_summary
from hexapod_pin.results.support_polygon import (
    longitudinal_margins,
    static_margin,
    support_polygon,
)
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap, load_torque_map
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_trace
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.results.walk_verdict import WalkVerdict, walk_verdict
from hexapod_pin.results.zero_moment_point import (
    zero_moment_point,
    zero_moment_point_of_motion,
)

__all__ = [
    "BatteryLoad",
    "Checkpoint",
    "Comparison",
    "GaitEnergy",
    "JointDemand",
    "JointMoments",
    "MotorBudget",
    "MotorRanking",
    "MotorUse",
    "PeakVerdict",
    "PeakVerdicts",
    "PhaseTorques",
    "Stability",
    "Summary",
    "TorqueBudget",
    "TorqueMap",
    "Trace",
    "WalkMetrics",
    "WalkVerdict",
    "joint_demand",
    "joint_moments",
    "load_gait_energy",
    "load_study",
    "load_summary",
    "load_torque_map",
    "load_trace",
    "longitudinal_margins",
    "motor_budget",
    "motor_ranking",
    "nesm",
    "phase_torques",
    "stability",
    "static_margin",
    "support_polygon",
    "torque_budget",
    "walk_verdict",
    "write_study",
    "zero_moment_point",
    "zero_moment_point_of_motion",
]

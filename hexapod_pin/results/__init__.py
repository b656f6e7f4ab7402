"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.gait_energy import GaitEnergy, load_gait_energy
from hexapod_pin.results.joint_moments import JointMoments, joint_moments
from hexapod_pin.results.peak_verdict import PeakVerdict, PeakVerdicts
from hexapod_pin.results.phase_torque import PhaseTorques, phase_torques
from hexapod_pin.results.run_record import RunRecord
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
from hexapod_pin.results.stability_margins import (
    longitudinal_margins,
    nesm,
    static_margin,
    support_polygon,
    zero_moment_point,
    zero_moment_point_of_motion,
)
from hexapod_pin.results.summary import Summary, load_summary
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.results.torque_map import TorqueMap, load_torque_map
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_study, load_trace, write_study
from hexapod_pin.results.walk_metrics import WalkMetrics
from hexapod_pin.results.walk_verdict import WalkVerdict, walk_verdict

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
    "RunRecord",
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

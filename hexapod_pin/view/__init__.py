"""Look at walks: offline HTML files, or live in the browser; figures of laws and of results."""

from hexapod_pin.view.balance_figures import write_mass_center_figure, write_quasi_static_figure
from hexapod_pin.view.contact_figure import write_figure
from hexapod_pin.view.html import live_viewer, view, write_html
from hexapod_pin.view.map_figures import (
    write_gait_energy_figure,
    write_torque_curves,
    write_torque_heat_map,
)
from hexapod_pin.view.notebook import notebook_html
from hexapod_pin.view.selection_report import write_selection_report
from hexapod_pin.view.side_by_side import write_side_by_side
from hexapod_pin.view.study_figures import write_comparison_figure
from hexapod_pin.view.study_report import write_study_report
from hexapod_pin.view.trace_plots import TracePlots
from hexapod_pin.view.walk_figures import write_joint_motion_figure, write_joint_torque_figure

__all__ = [
    "TracePlots",
    "live_viewer",
    "notebook_html",
    "view",
    "write_comparison_figure",
    "write_figure",
    "write_gait_energy_figure",
    "write_html",
    "write_joint_motion_figure",
    "write_joint_torque_figure",
    "write_mass_center_figure",
    "write_quasi_static_figure",
    "write_selection_report",
    "write_side_by_side",
    "write_study_report",
    "write_torque_curves",
    "write_torque_heat_map",
]

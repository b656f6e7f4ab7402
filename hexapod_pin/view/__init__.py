"""Look at walks: offline HTML files, or live in the browser; figures of laws and comparisons."""

from hexapod_pin.view.comparison_figure import write_comparison_figure
from hexapod_pin.view.contact_figure import write_figure
from hexapod_pin.view.html import live_viewer, view, write_html
from hexapod_pin.view.side_by_side import write_side_by_side

__all__ = [
    "live_viewer",
    "view",
    "write_comparison_figure",
    "write_figure",
    "write_html",
    "write_side_by_side",
]

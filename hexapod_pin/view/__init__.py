"""Look at a walk: one offline HTML file, or live in the browser; figures of contact laws."""

from hexapod_pin.view.contact_figure import write_figure
from hexapod_pin.view.html import live_viewer, view, write_html
from hexapod_pin.view.side_by_side import write_side_by_side

__all__ = ["live_viewer", "view", "write_figure", "write_html", "write_side_by_side"]

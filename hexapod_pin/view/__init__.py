"""Look at a walk: one offline HTML file, or live in the browser."""

from hexapod_pin.view.html import live_viewer as live_viewer
from hexapod_pin.view.html import view as view
from hexapod_pin.view.html import write_html as write_html

"""The report of a motor selection for a design review: one HTML page, or a PDF of A4 pages."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.file_ending import check_ending
from hexapod_pin.view.figure_file import require_matplotlib

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import MotorSelection

ENDINGS = (".html", ".htm", ".pdf")

STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "hexapod-pin",
}
"""Of matplotlib, over its defaults: a user's own settings do not change a report."""


@checked
def write_selection_report(
    selection: MotorSelection, path: str | Path, *, date: str | None = None
) -> Path:
    r"""Write the report of a motor selection, wholly or not at all, and return its path.

    An HTML page needs no network, no script and no other file; a PDF has pages of A4. Both hold
    the same: verdict, choice, ranking, figures, what was simulated, derating with its evidence,
    assumptions, data and sources of the motors. The same selection gives the same bytes.

    Args:
        selection: the result of `select_motors`.
        path: ends in .html or .pdf.
        date: printed as it is; None: none is printed.

    Raises:
        TraceFileError: another ending, or the file cannot be written.
        ParameterError: the selection has no motor to report on.
        MissingPackageError: matplotlib is not installed.

    Example:
        >>> found = select_motors('schema = 1\n[base]\nrobot = "kharagpur"')
        >>> write_selection_report(found, "motors.html")
    """
    ending = check_ending(path, ENDINGS)
    if not selection.candidates and selection.choice is None:
        raise ParameterError(
            "selection.candidates", 0, "one motor or more", "Choose motors of the catalogue."
        )
    return write_atomically(path, _content(selection, ending, date))


def _content(selection: MotorSelection, ending: str, date: str | None) -> bytes:
    from hexapod_pin.view.selection_sections import selection_blocks

    require_matplotlib("the report on a choice of motors")
    import matplotlib

    style: Any = STYLE
    blocks = tuple(selection_blocks(selection, date))
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(style)
        if ending == ".pdf":
            from hexapod_pin.view.selection_pdf import pdf_pages

            return pdf_pages(blocks)
        from hexapod_pin.view.selection_page import html_page

        return html_page(blocks)

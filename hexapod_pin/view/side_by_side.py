"""Several runs played in one offline page: curves overlaid, robots as ghosts or side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.foreign_text import encoded
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.html import page_text


@checked
def write_side_by_side(
    traces: Mapping[str, Trace],
    path: str | Path,
    *,
    spread: Mapping[str, Sequence[Trace]] = MappingProxyType({}),
    motor: MotorRecord | None = None,
    force_scale: float | None = None,
    command: str = "",
    package_path: Sequence[str | Path] = (),
) -> Path:
    """Write one HTML file that plays several runs in step, offline.

    Curves of the other runs are drawn over those of the first, and the table of worst instants has
    the differences from it. Robots stand side by side, each on its ground and with its name, or the
    others as ghosts in the first one's place. A run that ends before the others stands still from
    then on. Guarantees are those of `write_html`.

    Args:
        traces: what to show, by name.
        path: the file; an old one is replaced, or left alone where anything fails.
        spread: further runs of a trace's case, by its name, for bands of its curves.
        motor: the motor to hold torques against; None: that of each run, else its limits.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N], the same in all runs; None fits it
            to each robot's weight.
        command: what made the runs, shown for copying.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Returns:
        The path written to.

    Raises:
        ViewerError: a trace cannot be drawn (the message names the run), or meshcat's files are
            missing.
        ParameterError: no trace, or `force_scale` is out of range; `spread` has a name that is no
            trace's, or a run with other joints, feet or times of samples than its trace.
        TraceFileError: the file cannot be written.
    """
    text = page_text(
        traces, spread=spread, motor=motor, force_scale=force_scale, command=command,
        package_path=package_path,
    )  # fmt: skip
    return write_atomically(path, encoded(text))

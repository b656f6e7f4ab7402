"""The page of S1's comparison in the documentation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.text_table import Table
from hexapod_pin.view.figure_file import write_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "s1_comparison.md"
INTERNAL_FIGURE = "foot_control_internal.svg"
BOUNDS_FIGURE = "foot_control_bounds.svg"


def comparison_figure(robot: str) -> str:
    """Return the name of the figure of a robot's comparison."""
    return f"foot_control_{robot}.svg"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as SVG with its text as text; the same figure gives the same bytes."""
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": path.stem}):
        write_svg(figure, path)


def write_page(
    folder: Path, robots: Sequence[str], claims: Table, targets: Table, impacts: Table, walks: Table
) -> None:
    """Write the page; its words are fixed, its numbers those of the run."""
    pictures = "\n\n".join(
        f"![Changes on all grounds, {robot}]({comparison_figure(robot)})" for robot in robots
    )
    parts = [
        HEAD, pictures, "## S1's claims", CLAIMS, claims.markdown(), "## Targets",
        targets.markdown(), "## What bounds what was missed", BOUNDS,
        f"![Parameters on bumps]({BOUNDS_FIGURE})", impacts.markdown(), "## Internal forces",
        INTERNAL, f"![Internal forces]({INTERNAL_FIGURE})", f"## {walks.title}", WALKS,
        walks.markdown(), "## More", MORE,
    ]  # fmt: skip
    write_atomically(folder / PAGE, "\n\n".join(part.strip() for part in parts) + "\n")


HEAD = """
# S1's comparison

S1 corrects the positions of the feet by a PID on tangential contact forces, lets the legs yield to
normal forces (virtual suspension), adds both to the planned feet, and compares that with
conventional kinematic control. S1 prints neither equations nor gains nor numbers; `hp.FootControl`
has both parts with gains that follow from stated bandwidths (*assumed*). This page compares them
with `hp.KinematicControl`, with the same gains on all grounds. "All" adds touch-down detection and
levelling, which S1 does not have. `python scripts/studies foot_control` writes this page and its
figures; every number is in [the results](foot_control.md).
"""

CLAIMS = """
S1 describes the purpose of each part; the numbers are ours, of single runs where no interval is
given. A claim holds where all metrics of its row decrease; the last column counts the other robots
and grounds on which they do.

- A PID on the tangential force alone, as S1 has it ("slip, not anticipating"), makes feet slide
  *more* on most grounds: a correction made while a foot is loaded slides back as the foot unloads.
  It helps if feet are placed so that the yield of their servos under the nominal loads brings them
  to the plan (`SlipPid.anticipates`, not in S1); "slip" and "both" do that.
- It increases torques: feet that push against each other relieve the joints; without that they are
  higher (`torque_rms` of the results: 60 % on athena, 30 % on kharagpur, flat), though less energy
  is used.
- Suspension alone makes the trunk pitch more on flat ground, where no foot needs to yield, and on
  kharagpur increases the vertical acceleration there. It is meant for uneven ground.
- Touch-down detection mostly increases peak torques: a foot that meets ground early stops at once.
"""

BOUNDS = """
- **Peak force of kharagpur** is an impact. The highest forces come within a tick (5 ms) of contact,
  before a measurement can act, and depend on the speed at which feet arrive: a slower cycle or a
  lower lift reduces them, no gain does. Forces later than a tick are reduced by a quarter to two
  fifths.
- **Peak force of athena** comes later, as load moves from leg to leg. It is bounded by the tick and
  by the permitted travel: faster or softer suspensions gain no more.
- **Acceleration** is bounded by the tick. At 2.5 ms kharagpur's falls by more than 30 %, athena's
  nearly so; at 10 ms no gain remains. Twice the travel, or 10 Hz, makes kharagpur unstable and is
  refused; half the travel or a slower suspension has less effect. Damping matters little.
- **Arcs**: the force of the s2 contact depends on slip speed alone, so it tells little about how
  far feet have slid: 10 Hz on the force falls short of 40 %, 2 Hz on the slip does not. With a
  contact that sticks, 2 Hz on the slip costs more energy than permitted, and 10 Hz on the force
  none.
"""

INTERNAL = """
Internal forces are the part of the tangential forces that does not move the trunk: each foot's
force less its part of the sum and of the moment about the vertical, in proportion to its load. On
level ground the loads push legs apart, as far as the servos yield: forces are largest with *soft*
servos and smaller with stiffer ones, because the plan itself is consistent. Slip correction reduces
them, walking and standing; the suspension alone does not. With stiffer servos the default
suspension would be unstable and is refused: there its frequency is 0.6 of the limit.
"""

WALKS = """
The terrain is unknown to the robot; the same walks are shown without the controller. Conventional
control gets as far on these grounds; foot control slides and drifts less on most of them. A corner
of the trunk below the ground also counts as a fall, because the trunk has no contact in these runs
(`Scene.body_contact` is off).
"""

MORE = """
- Ranking with noise, delay, drives and estimated forces, in the results: on bumps "both" and "all"
  lead with noise and with the drive, as in the ideal case. With a delay of 10 ms, or forces from
  torques, little remains of the suspension's gain; with forces from currents, which do not include
  friction, touch-down detection is harmful on flat ground, and "both" is the best there.
- [Results](foot_control.md): all metrics on all grounds, errors against a
  reference at 1e-8, and tuned gains on ground that they were not tuned on.
- [What 200 Hz control costs](closed_loop_cost.md).
"""

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

S1 corrects the places of the feet by a PID on tangential contact forces, lets the legs yield to
normal forces (virtual suspension), adds both to the planned feet, and compares that with
conventional kinematic control. S1 prints neither equations nor gains nor numbers; `hp.FootControl`
has both parts with gains that follow from stated bandwidths (*assumed*). Here they are beside
`hp.KinematicControl`, with the same gains on all grounds. "All" adds touch-down by feel and
levelling, which S1 does not have. This page and its figures are written by
`python scripts/studies foot_control`; every number is in
[the results](results/foot_control.md).
"""

CLAIMS = """
S1 says in words what each part is for; the numbers are ours, single runs where no interval is
given. A claim holds where all metrics of its row fall; the last column counts the other robots
and grounds on which they do.

- A PID on the tangential force alone, as S1 has it ("slip, not anticipating"), makes feet slide
  *more* on most grounds: what it takes back while a foot is loaded slides again as the foot
  unloads. It helps once feet are put where their servos will have given way to the nominal loads
  (`SlipPid.anticipates`, not in S1); "slip" and "both" do that.
- It has a price: feet that push against each other spare the joints; without that the torques are
  higher (`torque_rms` of the results: 60 % on athena, 30 % on kharagpur, flat), though less energy
  is used.
- Suspension alone makes the trunk pitch more on flat ground, where nothing needs to yield, and on
  kharagpur raises the vertical acceleration there. It is for uneven ground.
- Touch-down by feel mostly raises peak torques: a foot that meets ground early stops at once.
"""

BOUNDS = """
- **Peak force of kharagpur** is an impact. The highest forces come within a tick (5 ms) of contact,
  before anything that is measured can act, and go with the speed at which feet arrive: a slower
  cycle or a lower lift cuts them, no gain does. What comes later than a tick is cut by a quarter to
  two fifths.
- **Peak force of athena** comes later, as load moves from leg to leg. It is bounded by the tick and
  by what may be yielded: faster or softer suspensions gain no more.
- **Acceleration** is bounded by the tick. At 2.5 ms kharagpur's falls by more than 30 %, athena's
  nearly so; at 10 ms nothing is left. Twice the travel, or 10 Hz, makes kharagpur shake and is
  refused; half the travel or a slower suspension does less. Damping matters little.
- **Arcs**: the force of the s2 contact depends on slip speed alone, so it says little of how far
  feet have slid: 10 Hz on the force falls short of 40 %, 2 Hz on the slip does not. With a contact
  that sticks, 2 Hz on the slip costs more energy than was allowed, and 10 Hz on the force none.
"""

INTERNAL = """
What of the tangential forces drives the trunk nowhere: each foot's force less the share of the sum
and of the moment about the vertical that goes with its load. On level ground legs are pushed apart
by their loads, as far as the servos give: forces are largest with *soft* servos, and stiffer ones
squeeze less, as the plan itself is consistent. Slip correction relieves them, walking and
standing; the suspension alone does not. With stiffer servos the default suspension would shake and
is refused: there its frequency is 0.6 of the border.
"""

WALKS = """
Terrain unknown to the robot; without the controller the same walks. Conventional control gets as
far on these grounds; the controller slides and drifts less on most of them. A fall is also counted
where a corner of the trunk gets below the ground, which nothing holds up in these runs
(`Scene.body_contact` is off).
"""

MORE = """
- Ranking with noise, delay, drives and estimated forces, in the results: on bumps "both" and "all"
  lead with noise and with the drive, as in the ideal case. With a delay of 10 ms, or forces from
  torques, little is left of the suspension's gain; with forces from currents, which do not know
  of friction, touch-down by feel does harm on flat ground, and "both" is the best there.
- [Results](results/foot_control.md): all metrics on all grounds, errors against a
  reference at 1e-8, and tuned gains on ground that they were not tuned on.
- [What 200 Hz control costs](results/closed_loop_cost.md).
"""

"""The page of S1's comparison in the documentation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.validation.tables import Table

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
        figure.savefig(path, metadata={"Date": None})


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
    (folder / PAGE).write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")


HEAD = """
# S1's comparison

S1 corrects the places of the feet by a PID on tangential contact forces, lets the legs yield to
normal forces (virtual suspension), adds both to the planned feet, and compares that with
conventional kinematic control. S1 prints neither equations nor gains nor numbers; `hp.FootControl`
has both parts with gains that follow from stated bandwidths (*assumed*). Here they are beside
`hp.KinematicControl`, with the same gains on all grounds. "All" adds touch-down by feel and
levelling, which S1 does not have. This page and its figures are written by
`python benchmarks/foot_control.py`; every number is in
[the results](../benchmarks/results/foot_control.md).
"""

CLAIMS = """
S1 says in words what each part is for; the numbers are ours. Last column: other robots and grounds
on which all metrics of the row fall. As S1 has it, a PID on the tangential force alone
("slip, not anticipating") makes feet slide *more*: what it takes back while a foot is loaded slides
again as the foot unloads. The correction helps once feet are put where their servos will have given
way to the nominal loads (`SlipPid.anticipates`, not in S1).
It also has a price: feet that no longer push against each other leave the legs' torques to hold the
weight, and joint torques rise (column `torque_rms` of the results).
"""

BOUNDS = """
- **Peak force of kharagpur** is an impact: the highest forces come within a tick (5 ms) of contact,
  before anything measured can act. Leg and foot arrive at the speeds of the table; the force of the
  impact goes with that speed, so a slower gait or a lower lift cuts it, and no gain does. Forces that
  come later than a tick are cut by 30 % and more.
- **Peak force of athena** comes later, as load moves over from leg to leg. Shorter ticks help (the
  default suspension is as fast as they allow), longer ones undo the gain.
- **Acceleration** is cut most with a travel of 2 to 4 mm. A softer suspension at the same
  frequency, or a faster one, makes the robot shake and is refused; a stiffer or slower one
  does less. Walking slowly leaves little to cut.
"""

INTERNAL = """
What of the tangential forces drives the trunk nowhere: each foot's force less the share of the sum
and of the moment about the vertical that goes with its load. On level ground legs are pushed apart
by their loads, as far as the servos give: forces are largest with *soft* servos, and stiffer ones
squeeze less, as the plan itself is consistent. Slip correction relieves them, walking and standing;
the suspension alone does not. With stiffer servos the default suspension would shake and is refused:
there its frequency is 0.6 of the border.
"""

WALKS = """
Terrain unknown to the robot; without the controller the same walks. A fall is also counted where a
corner of the trunk gets below the ground, which nothing holds up in these runs
(`Scene.body_contact` is off).
"""

MORE = """
[Results](../benchmarks/results/foot_control.md): all metrics on all grounds, the ranking with noise,
delay, drives and estimated forces, errors against a reference at 1e-8, and tuned gains on ground that
they were not tuned on. [What 200 Hz control costs](../benchmarks/results/closed_loop_cost.md).
"""

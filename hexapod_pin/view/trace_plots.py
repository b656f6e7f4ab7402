"""Figures of a trace, one call each: `trace.plot("torque")`, `trace.plot.foot_forces()`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.schema import require_known
from hexapod_pin.view.balance_figures import POLYGONS, draw_mass_center
from hexapod_pin.view.figure_file import DPI, figure_bytes, require_matplotlib
from hexapod_pin.view.walk_figures import (
    COLORS,
    KINDS,
    add_legend,
    draw_joint_motion,
    draw_joint_torques,
    label_rows,
    leg_grid,
    legs_of,
    robot_of,
    shade_stance,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.arrays import Array
    from hexapod_pin.results.trace import Trace

PANEL = 1.7
"""Height of a panel [inch]."""

Span = tuple[float, float] | None


class JointChannel(NamedTuple):
    """What is drawn of every joint.

    Attributes:
        values: of a trace. Shape (T, n).
        label: with its unit.
        title: of the figure.
    """

    values: Callable[[Trace], Array]
    label: str
    title: str


class FootChannel(NamedTuple):
    """What is drawn of every foot: one curve or several.

    Attributes:
        values: curves by name. Shape (T, F) each.
        label: with its unit.
        title: of the figure.
    """

    values: Callable[[Trace], dict[str, Array]]
    label: str
    title: str


JOINTS: dict[str, JointChannel] = {
    "torque": JointChannel(lambda t: t.torque, "torque [N m]", "torques of the joints"),
    "speed": JointChannel(lambda t: t.v[:, 6:], "rate [rad/s]", "rates of the joints"),
    "angle": JointChannel(lambda t: np.degrees(t.q[:, 7:]), "angle [°]", "angles of the joints"),
    "power": JointChannel(lambda t: t.torque * t.v[:, 6:], "power [W]", "mechanical power"),
    "current": JointChannel(lambda t: t.current, "current [A]", "currents of the motors"),
    "temperature": JointChannel(
        lambda t: t.temperature, "winding [°C]", "temperatures of the motors' windings"
    ),
}
FEET: dict[str, FootChannel] = {
    "foot_forces": FootChannel(
        lambda t: {"along the normal": t.normal_force,
                   "in the ground": np.linalg.norm(t.tangential_force, axis=2)},
        "force [N]", "forces on the feet",
    ),
    "slip": FootChannel(
        lambda t: {"along the ground": t.slip_speed}, "speed [m/s]", "sliding of the feet"
    ),
}  # fmt: skip


@checked
class TracePlots:
    """The figures of a trace, each a matplotlib Figure that notebooks show as a picture.

    `trace.plot("torque")` is `trace.plot.torque()`. Arguments of all that show legs: `legs`, names
    such as "lf", None for all, and `between`, two times [s], None for the whole run.

    Errors of all: `NotRecordedError` where the trace does not hold the samples,
    `UnknownNameError` for a leg or a figure that there is not, `ParameterError` for a robot without
    legs of coxa and femur or a time span without samples, `MissingPackageError` without matplotlib.
    """

    def __init__(self, trace: Trace) -> None:
        """Draw of this trace."""
        self.trace = trace

    def __repr__(self) -> str:
        """Return the names of the figures."""
        return f"<TracePlots: {', '.join(FIGURES)}>"

    def __call__(
        self, name: str = "torque", *, legs: Sequence[str] | None = None, between: Span = None
    ) -> Figure:
        """Return the figure of a name."""
        require_known("figure", name, FIGURES)
        require_matplotlib(f"trace.plot({name!r})")
        if name == "com":
            return _shown(draw_mass_center(self.trace))
        if name in FEET:
            return _shown(_draw_feet(self.trace, FEET[name], legs, between))
        return _shown(_draw_joints(self.trace, JOINTS[name], legs, between))

    def torque(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the joints' torques [N m], a panel for each leg; stance is shaded."""
        return self("torque", legs=legs, between=between)

    def speed(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the joints' rates [rad/s]."""
        return self("speed", legs=legs, between=between)

    def angle(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the joints' angles [degrees]."""
        return self("angle", legs=legs, between=between)

    def power(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return torque times rate of the joints [W]."""
        return self("power", legs=legs, between=between)

    def current(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the motors' currents [A], of a run that recorded them."""
        return self("current", legs=legs, between=between)

    def temperature(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the temperatures of the motors' windings [°C], of a run that recorded them."""
        return self("temperature", legs=legs, between=between)

    def foot_forces(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the forces on the feet along the ground's normal and in the ground [N]."""
        return self("foot_forces", legs=legs, between=between)

    def slip(self, *, legs: Sequence[str] | None = None, between: Span = None) -> Figure:
        """Return the speeds of the contact points along the ground [m/s], where recorded."""
        return self("slip", legs=legs, between=between)

    def com(self, *, polygons: int = POLYGONS) -> Figure:
        """Return the path of the centre of mass, as `view.write_mass_center_figure`."""
        require_matplotlib("trace.plot.com()")
        return _shown(draw_mass_center(self.trace, polygons=polygons))

    def joint_motion(self, *, legs: Sequence[str] | None = None, cycles: int = 2) -> Figure:
        """Return angles and rates with [S2]'s signs, as `view.write_joint_motion_figure`."""
        require_matplotlib("trace.plot.joint_motion()")
        return _shown(draw_joint_motion(self.trace, legs, cycles=cycles))

    def joint_moments(self, *, legs: Sequence[str] | None = None, cycles: int = 2) -> Figure:
        """Return torques and total moments, as `view.write_joint_torque_figure`."""
        require_matplotlib("trace.plot.joint_moments()")
        return _shown(draw_joint_torques(self.trace, legs, cycles=cycles))


FIGURES = (*JOINTS, *FEET, "com")
"""Names of the figures that `trace.plot(name)` draws."""


def _shown(figure: Figure) -> Figure:
    """Let a notebook show the figure as a picture, whether pyplot is in use or not."""
    vars(figure)["_repr_png_"] = lambda: figure_bytes(figure, "png", dpi=DPI)
    return figure


def _span(trace: Trace, between: Span) -> slice:
    """Return the samples between two times.

    Raises:
        ParameterError: there are fewer than two.
    """
    if between is None:
        return slice(None)
    first = int(np.searchsorted(trace.time, between[0]))
    last = int(np.searchsorted(trace.time, between[1], side="right"))
    if last - first < 2:
        allowed = f"two times within {trace.time[0]:g} to {trace.time[-1]:g} s, the lower first"
        raise ParameterError("between", between, allowed)
    return slice(first, last)


def _draw_joints(
    trace: Trace, channel: JointChannel, legs: Sequence[str] | None, between: Span
) -> Figure:
    """Draw one quantity of the joints, a panel for each leg."""
    shown, inside, values = legs_of(trace, legs), _span(trace, between), channel.values(trace)
    figure, panels = leg_grid(shown, 1, PANEL)
    for leg, (axes,) in zip(shown, panels, strict=True):
        _shade(axes, trace, inside, leg.foot)
        for k, joint in enumerate(leg.joints):
            axes.plot(trace.time[inside], values[inside, joint], color=COLORS[k], lw=0.9,
                      label=KINDS[k])  # fmt: skip
    return _labelled(figure, panels, trace, channel.label, channel.title)


def _draw_feet(
    trace: Trace, channel: FootChannel, legs: Sequence[str] | None, between: Span
) -> Figure:
    """Draw one quantity of the feet or several, a panel for each leg."""
    shown, inside, curves = legs_of(trace, legs), _span(trace, between), channel.values(trace)
    figure, panels = leg_grid(shown, 1, PANEL)
    for leg, (axes,) in zip(shown, panels, strict=True):
        _shade(axes, trace, inside, leg.foot)
        for color, (name, values) in zip(COLORS, curves.items(), strict=False):
            axes.plot(trace.time[inside], values[inside, leg.foot], color=color, lw=0.9, label=name)
    return _labelled(figure, panels, trace, channel.label, channel.title)


def _shade(axes: Axes, trace: Trace, inside: slice, foot: int) -> None:
    """Shade the time in which a foot is on the ground, where that was recorded."""
    if "contacts" in trace.recorded:
        shade_stance(axes, trace.time[inside], trace.contact[inside, foot])


def _labelled(
    figure: Figure, panels: list[list[Axes]], trace: Trace, label: str, title: str
) -> Figure:
    label_rows(panels, (label,), "time [s]")
    shaded = "contacts" in trace.recorded
    add_legend(figure, panels[0][0], f"{robot_of(trace)}: {title}", shaded=shaded)
    return figure

"""The figure of a contact law: a bounce, the restitution, friction against slip speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.ground.contact import Contact, FrictionLaw, NormalLaw, Restitution
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO, bounce, delivered_restitution
from hexapod_pin.view.figure_file import figure_bytes, figure_format

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@checked
def write_figure(
    law: NormalLaw | FrictionLaw | Contact, path: Path, *, mass: float, speed: float
) -> Path:
    """Draw a law into a file.

    Args:
        law: a normal law, a friction law, or a pair.
        path: ends in .png, .svg or .pdf.
        mass: of the drawn impact [kg].
        speed: of the drawn impact [m/s].

    Raises:
        ParameterError: another ending, or mass or speed is not positive.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return write_atomically(path, figure_bytes(draw(law, mass=mass, speed=speed), ending))


def draw(law: NormalLaw | FrictionLaw | Contact, *, mass: float, speed: float) -> Figure:
    """Return the figure of a law, with the panels it has something to show in."""
    from matplotlib.figure import Figure

    parts = (law.normal, law.friction) if isinstance(law, Contact) else (law,)
    normal = [part for part in parts if isinstance(part, NormalLaw)]
    friction = [part for part in parts if isinstance(part, FrictionLaw)]
    panels = 2 * len(normal) + len(friction)
    figure = Figure(figsize=(4.6 * panels, 4.0), layout="constrained")
    axes = list(figure.subplots(1, panels, squeeze=False)[0])
    for part in normal:
        _draw_bounce(axes[0], part, mass, speed)
        _draw_restitution(axes[1], part, mass)
    for slip in friction:
        _draw_friction(axes[-1], slip)
    return figure


def _draw_bounce(axes: Axes, law: NormalLaw, mass: float, speed: float) -> None:
    hit = bounce(law, mass=mass, speed=speed)
    axes.plot(hit.depth * 1e3, hit.force)
    axes.set_xlabel("penetration [mm]")
    axes.set_ylabel("normal force [N]")
    axes.set_title(f"{mass:g} kg at {speed:g} m/s: restitution {hit.restitution:.3f}")


def _draw_restitution(axes: Axes, law: NormalLaw, mass: float) -> None:
    axes.set_ylabel("delivered restitution")
    axes.set_ylim(0.0, 1.0)
    if not isinstance(law, Restitution):  # no restitution was requested
        speeds = np.geomspace(1e-2, 1.0, 25)
        axes.semilogx(speeds, [bounce(law, mass=mass, speed=v).restitution for v in speeds])
        axes.set_xlabel("approach speed [m/s]")
        return
    requested = np.linspace(0.05, 1.0, 39)
    for name, eta in DAMPING_RATIO.items():
        own = name == law.model
        delivered = [delivered_restitution(eta(float(e))) for e in requested]
        axes.plot(requested, delivered, label=name, lw=2.5 if own else 0.8, zorder=3 if own else 2)
    axes.plot(law.restitution, law.delivered, "ko", zorder=4)
    axes.set_xlabel("requested restitution")
    axes.legend(fontsize="x-small")


def _draw_friction(axes: Axes, law: FrictionLaw) -> None:
    top = law.creep_speed(0.99 * law.limit) or 1e-3  # a law without creep: any speed will do
    speeds = np.concatenate(([0.0], np.geomspace(1e-4 * top, 20.0 * top, 400)))
    axes.plot(speeds * 1e3, law.coefficient(speeds))
    axes.set_xlabel("slip speed [mm/s]")
    axes.set_ylabel("friction / normal force")
    axes.set_title(f"holds up to {law.limit:.3g}")

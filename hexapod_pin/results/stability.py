"""The stability of a walk is measured by margins at every sample, and can be printed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, protect
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.stability_margins import (
    at_middles,
    contact_points,
    horizontal_axes,
    nesm,
    zero_moment_point,
)
from hexapod_pin.results.steady_window import Window, steady_window
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.rotations import trunk_yaw, yawed
from hexapod_pin.robot.static_margins import longitudinal_margins, static_margin
from hexapod_pin.text_table import Table

MARGINS: dict[str, str] = {
    "static_margin": "static stability margin",
    "margin_ahead": "polygon's edge ahead of the centre of mass",
    "margin_behind": "polygon's edge behind the centre of mass",
    "nesm": "normalised energy stability margin",
    "zmp_margin": "zero-moment point inside the polygon",
}
"""Name: meaning of every margin [m], in the order of tables."""

EXCURSIONS = ("along", "lateral", "vertical")

GROUNDED = (
    "A foot is grounded at a sample where the ground pushed on it (mean normal force > 0) in the "
    "interval that ends there. Margins are negative outside the polygon; none of no feet."
)


@dataclass(frozen=True, eq=False)
class Stability(Immutable):
    """Margins of a walk at the T samples of its window; lengths in metres, world axes.

    Everything is projected along gravity, on slopes too. `GROUNDED` defines which feet count.

    Attributes:
        robot_name: name of the robot.
        window: which samples.
        weight: total mass times gravity [N].
        time: [s]. Shape (T,).
        com: centre of mass. Shape (T, 3).
        excursion: of the centre of mass from its mean straight line (least squares in time): along
            the line's direction across gravity, to the left of it, and up. Shape (T, 3).
        feet_down: number of grounded feet. Shape (T,).
        static_margin: distance of the centre of mass to the polygon's edges. Shape (T,).
        margin_ahead: distance to the polygon's edge along the heading. Shape (T,).
        margin_behind: the same backwards. Shape (T,). -inf both, where that line misses it.
        nesm: least rise of the centre of mass by which the robot tips over. Shape (T,).
        zmp: zero-moment point, mean over the interval; NaN without a loaded foot. Shape (T, 3).
        zmp_margin: its distance to the polygon's edges, in the middle of the interval. Shape (T,).
    """

    robot_name: str
    window: Window
    weight: float
    time: Array = field(repr=False)
    com: Array = field(repr=False)
    excursion: Array = field(repr=False)
    feet_down: Array = field(repr=False)
    static_margin: Array = field(repr=False)
    margin_ahead: Array = field(repr=False)
    margin_behind: Array = field(repr=False)
    nesm: Array = field(repr=False)
    zmp: Array = field(repr=False)
    zmp_margin: Array = field(repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        protect(self)

    @property
    def longitudinal_margin(self) -> Array:
        """(T,) [m]: the smaller of the margins ahead and behind."""
        return np.minimum(self.margin_ahead, self.margin_behind)

    @property
    def energy_margin(self) -> Array:
        """(T,) [J]: energy stability margin, weight times `nesm`."""
        return self.weight * self.nesm

    def least(self, name: str) -> tuple[float, float]:
        """Return the least value of a margin [m] and its time [s]; -inf where no foot stood.

        Args:
            name: one of `MARGINS`.

        Raises:
            UnknownNameError: there is no such margin.
        """
        require_known("margin", name, MARGINS)
        values = getattr(self, name)
        k = int(np.argmin(values))
        return float(values[k]), float(self.time[k])

    def to_dict(self, *, samples: bool = False) -> dict[str, Any]:
        """Return plain data: least, mean and largest values; None for what is not finite.

        Args:
            samples: whether to add the arrays.
        """
        plain: dict[str, Any] = {
            "robot_name": self.robot_name,
            "window": {"start": self.window.start, "end": self.window.end,
                       "cycles": self.window.cycles},
            "weight": self.weight,
            "energy_margin": float(self.energy_margin.min()),
            "grounded": GROUNDED,
            "least_feet_down": int(self.feet_down.min()),
            "margins": {name: self._row(name) for name in MARGINS},
            "excursion": {
                name: {"peak_to_peak": float(np.ptp(values)), "rms": float(_rms(values))}
                for name, values in zip(EXCURSIONS, self.excursion.T, strict=True)
            },
        }  # fmt: skip
        if samples:
            names = ("time", "com", "excursion", "feet_down", "zmp", *MARGINS)
            plain["samples"] = {name: getattr(self, name).tolist() for name in names}
        finite: dict[str, Any] = without_non_finite(plain)
        return finite

    def _row(self, name: str) -> dict[str, float]:
        values, (least, time) = getattr(self, name), self.least(name)
        return {"least": least, "time": time, "mean": float(np.mean(values)),
                "largest": float(np.max(values))}  # fmt: skip

    def to_json(self) -> str:
        """Return `to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def table(self) -> str:
        """Return a plain text table, lengths in millimetres."""
        return "\n".join(stability_lines(self.to_dict(), MARGINS))


@checked
def stability(trace: Trace, *, whole: bool = False) -> Stability:
    """Return how stably a walk stands, over whole gait cycles after the start-up.

    Static margin and longitudinal margins: McGhee & Frank 1968. NESM: Messuri & Klein 1985, Hirose
    et al. 2001. The heading is the direction of travel, turned with the trunk's yaw.

    Args:
        trace: of a run.
        whole: all samples instead of the window of `torque_budget`.

    Raises:
        ParameterError: the run holds no whole cycle (the error has the duration needed), the
            feet's radii are not known, or there is no gravity.

    Example:
        >>> found = stability(trace)
        >>> found.least("static_margin")
    """
    window = _whole(trace) if whole else steady_window(trace)
    inside, gravity = window.samples, np.array(trace.run.gravity)
    axes = horizontal_axes(gravity)
    points, down = contact_points(trace), trace.contact
    flat = points @ axes[:2].T
    place, zmp = trace.com @ axes[:2].T, zero_moment_point(trace)
    ahead, behind = longitudinal_margins(
        flat[inside], place[inside], _heading(trace, axes)[inside], down[inside]
    )
    return Stability(
        robot_name=trace.run.robot.name,
        window=window,
        weight=trace.run.robot.mass * float(np.linalg.norm(gravity)),
        time=trace.time[inside],
        com=trace.com[inside],
        excursion=_excursion(
            trace.time[inside], trace.com[inside], _heading(trace, axes)[inside], axes
        ),
        feet_down=down[inside].sum(axis=1),
        static_margin=static_margin(flat[inside], place[inside], down[inside]),
        margin_ahead=ahead,
        margin_behind=behind,
        nesm=nesm(points[inside], trace.com[inside], down[inside], gravity),
        zmp=zmp[inside],
        zmp_margin=static_margin(
            at_middles(flat)[inside], (zmp @ axes[:2].T)[inside], down[inside]
        ),
    )


def _whole(trace: Trace) -> Window:
    time = trace.time
    return Window(0, len(time) - 1, float(time[0]), float(time[-1]), None)


def _heading(trace: Trace, axes: Array) -> Array:
    """Return the direction of travel across gravity, in `axes`' first two. Shape (T, 2)."""
    along = np.array(trace.run.walk.travel_direction)
    world = yawed(along, trunk_yaw(trace.q) - trunk_yaw(trace.q[:1]))
    heading = world @ axes[:2, :2].T
    found: Array = heading / np.linalg.norm(heading, axis=1, keepdims=True)
    return found


def _excursion(time: Array, com: Array, heading: Array, axes: Array) -> Array:
    """Return what is left of a line through the centres of mass: along, left, up. Shape (T, 3)."""
    since = time - time.mean()
    square = float(np.sum(since**2))
    speed = since @ com / square if square > 0.0 else np.zeros(3)
    rest = (com - com.mean(axis=0) - since[:, None] * speed) @ axes.T
    mean = heading.mean(axis=0)
    mean = mean / max(float(np.linalg.norm(mean)), np.finfo(float).tiny)
    along, left = rest[:, :2] @ mean, rest[:, :2] @ np.array([-mean[1], mean[0]])
    return np.stack([along, left, rest[:, 2]], axis=1)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


# The margins of a walk as plain text.


def _answer(data: Mapping[str, Any]) -> str:
    """Return whether the centre of mass stays over the feet, in one line."""
    row = data["margins"]["static_margin"]
    name, least = data["robot_name"], row["least"]
    if least is None:
        return f"{name}: no foot on the ground at {row['time']:.3f} s"
    if least < 0.0:
        return (
            f"{name} is not statically stable: its centre of mass is up to {-1e3 * least:.0f} mm "
            f"outside its feet ({row['time']:.3f} s)"
        )
    return f"{name} is statically stable: margin {1e3 * least:.0f} mm at least"


def stability_lines(data: Mapping[str, Any], meanings: Mapping[str, str]) -> list[str]:
    """Return the lines of a table, lengths in millimetres.

    Args:
        data: as of `Stability.to_dict`.
        meanings: of its margins, in the order of the table.
    """
    window = data["window"]
    count = window["cycles"]
    cycles = "" if count is None else f", {count} whole gait cycle{'s' * (count > 1)}"
    margins = []
    for name, meaning in meanings.items():
        row = data["margins"][name]
        least, mean, largest = (
            None if row[key] is None else 1e3 * row[key] for key in ("least", "mean", "largest")
        )
        margins.append([meaning, least, f"{row['time']:.3f}", mean, largest])
    sizes = [
        [name, f"{1e3 * size['peak_to_peak']:8.3f} peak to peak, {1e3 * size['rms']:8.3f} RMS"]
        for name, size in data["excursion"].items()
    ]
    head = ("[mm]", "least", "at [s]", "mean", "largest")
    moved = "Centre of mass about its mean straight line [mm]"
    energy = data["energy_margin"]
    least = "none" if energy is None else f"{energy:.4g} J"
    return [
        _answer(data),
        f"window: {window['start']:.4g} to {window['end']:.4g} s{cycles}",
        "",
        *Table("", head, margins, "<>", False, ".2f", "none", least=7).lines(),
        "",
        *Table(moved, (), sizes, least=max(map(len, meanings.values()))).lines(),
        "",
        f"feet down, at least: {data['least_feet_down']}",
        f"energy stability margin, least: {least}",
        data["grounded"],
    ]

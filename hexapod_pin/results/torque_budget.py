"""The torque budget: what every joint must deliver over whole cycles of steady walking.

Powers and energies are mechanical, at the joint: torque times rate. What motors and gears lose
comes on top.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.joint_budget import (
    JointBudget,
    KindBudget,
    joint_lines,
    kind_lines,
    kind_rows,
    summary_rows,
)
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.run_record import RunRecord
from hexapod_pin.results.sampled_summary import summary_of
from hexapod_pin.results.schema import named
from hexapod_pin.results.steady_window import Window, summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.shown import drawn
from hexapod_pin.text_table import indented, labelled


@checked
def torque_budget(run: Trace | Summary) -> TorqueBudget:
    """Return what every joint must deliver, over whole cycles after the start-up transient.

    Energies and distance are per cycle. Where nothing repeats (a posture held), the window is the
    second half of the run, energies are those of the window, and there is no cost of transport.
    Peaks are those of accepted steps, where the run gathered a summary; of samples otherwise.

    Args:
        run: a trace, or the summary of a run.

    Raises:
        ParameterError: the run holds no whole cycle of steady walking; the error names the
            duration needed.
    """
    if isinstance(run, Summary):
        summary, time, peaks = run, None, ACCEPTED_STEPS
    else:
        summary, time = summary_of(run), run.time
        peaks = ACCEPTED_STEPS if run.has_summary else SAMPLES
    window, record = summary_window(summary, time), summary.run
    joints, duration = summary_rows(summary), (window.end - window.start) / window.parts
    distance, turn_rate = summary.distance, summary.measured_turn_rate
    budget = TorqueBudget(
        robot_name=record.robot.name,
        window=window,
        joints=joints,
        kinds=kind_rows(joints),
        positive_energy=sum(row.positive_energy for row in joints),
        negative_energy=sum(row.negative_energy for row in joints),
        distance=distance,
        measured_speed=None if distance is None else distance / duration,
        nominal_speed=None if window.cycles is None else record.walk.nominal_speed,
        weight=(record.robot.total_mass or 0.0) * float(np.linalg.norm(record.gravity)),
        largest_outside=_largest_outside(summary, max(row.torque_peak for row in joints)),
        sources=_sources(record),
        assumed=record.assumed,
        peaks=peaks,
        turn=None if turn_rate is None else turn_rate * duration,
        nominal_turn=record.walk.turn_rate * duration,
    )
    _require_numbers(budget)
    return budget


def _require_numbers(budget: TorqueBudget) -> None:
    """Refuse a budget with numbers that are none, as of forged samples.

    Raises:
        ParameterError: names the joint, or the number of the whole robot.
    """
    whole = ("positive_energy", "negative_energy", "weight", "distance", "measured_speed", "turn")
    found = {name: getattr(budget, name) for name in whole}
    for row in budget.joints:
        for name in ("torque_peak", "torque_rms", "positive_energy", "negative_energy"):
            found[f"{row.joint}.{name}"] = getattr(row, name)
    for name, value in found.items():
        if value is not None and not math.isfinite(value):
            hint = "The samples, or the summary, that it is made of are no run's."
            raise ParameterError(f"TorqueBudget.{name}", value, "finite", hint)


def _largest_outside(summary: Summary, peak: float) -> tuple[str, float, float] | None:
    """Return joint, time and size of the largest torque outside the window, if above the peak."""
    size = np.abs(summary.outside_torque)
    worst = int(np.argmax(size))
    if not size[worst] > peak:
        return None
    time = float(summary.outside_torque_time[worst])
    return summary.joint_names[worst], time, float(size[worst])


def _sources(run: RunRecord) -> tuple[str, ...]:
    """Return what was simulated, one line each: robot, walk, contact, numerics."""
    control, contact = run.case.controller, None if run.scene is None else run.scene.contact
    gait, step = control.get("gait", {}), run.numerics.step
    walk = _walk_texts(gait) if isinstance(gait, Mapping) else []
    method = run.numerics.method
    rows = {
        "robot": run.robot.provenance,
        "control": ", ".join(map(str, filter(None, [control.get("kind"), *walk]))),
        "contact": "" if contact is None else contact.describe(),
        "method": method and f"{method}" + (f", step {step:g} s" if step else ""),
    }
    return tuple(f"{key}: {text}" for key, text in rows.items() if text)


def _walk_texts(gait: Mapping[str, Any]) -> list[Any]:
    sizes = {name: gait.get(name) for name in ("stroke", "cycle_time")}
    texts = [f"{name} {x:g}" for name, x in sizes.items() if isinstance(x, int | float)]
    return [gait.get("name"), *texts]


# The torque budget of a whole robot as data, and as text.

ACCEPTED_STEPS, SAMPLES = "accepted steps", "samples"
"""What peaks are taken from."""

PEAK_CAVEAT = {
    ACCEPTED_STEPS: (
        "Peaks include every accepted step, not only the stored samples. A raw peak follows a "
        "touch-down, or how feet share the load: it depends on the stiffness of contact and "
        "servos, and on the accuracy or step. `--verdict` (judge_peaks) shows which peaks hold."
    ),
    SAMPLES: (
        "Peaks are those of samples: what lies between two is missed. A raw peak follows a "
        "touch-down, or how feet share the load: it depends on the stiffness of contact and "
        "servos, on step and sampling. `--verdict` (judge_peaks) shows which peaks hold."
    ),
}


@dataclass(frozen=True)
class TorqueBudget(Immutable):
    """The budget of a whole robot; `table()` prints it.

    Attributes:
        robot_name: name of the robot.
        window: the samples used.
        joints: one row per joint, in the trace's order.
        kinds: one row per kind of joint.
        positive_energy: work given by all joints per cycle (or window) [J].
        negative_energy: work taken up by all joints per cycle (or window) [J], <= 0.
        distance: of the centre of mass per cycle along the heading [m]; None without cycles.
        measured_speed: distance per time [m/s]; None without cycles.
        nominal_speed: of the gait [m/s]; None where the trace does not contain it.
        weight: total mass times gravity [N].
        largest_outside: a larger torque outside the window: joint, time [s], torque [N m].
        sources: what was simulated, one line each.
        assumed: statements of what is assumed rather than taken from a source.
        peaks: what peaks are taken from: "accepted steps" or "samples".
        turn: yaw per cycle [rad], left > 0; None without cycles.
        nominal_turn: of the gait per cycle [rad]; 0 of a straight one.
    """

    robot_name: str
    window: Window
    joints: tuple[JointBudget, ...]
    kinds: tuple[KindBudget, ...]
    positive_energy: float
    negative_energy: float
    distance: float | None
    measured_speed: float | None
    nominal_speed: float | None
    weight: float
    largest_outside: tuple[str, float, float] | None
    sources: tuple[str, ...]
    assumed: tuple[str, ...]
    peaks: str = SAMPLES
    turn: float | None = None
    nominal_turn: float = 0.0

    @property
    def absolute_energy(self) -> float:
        """Integral of |torque * rate| over all joints [J]: braking costs as much as driving."""
        return self.positive_energy - self.negative_energy

    @property
    def net_energy(self) -> float:
        """Integral of torque * rate over all joints [J]: braking gives everything back."""
        return self.positive_energy + self.negative_energy

    @property
    def cost_of_transport(self) -> float | None:
        """Absolute energy / (weight * distance) [-]; None where it does not move forward."""
        return self._per_distance(self.absolute_energy)

    @property
    def cost_of_transport_positive(self) -> float | None:
        """Positive energy / (weight * distance) [-]: braking costs and returns nothing."""
        return self._per_distance(self.positive_energy)

    @property
    def on_the_spot(self) -> bool:
        """Whether the gait turns without going anywhere."""
        return self.nominal_speed == 0.0 and self.nominal_turn != 0.0

    @property
    def makes_way(self) -> bool:
        """Whether the robot moves forward, so that numbers per metre mean something."""
        return not self.on_the_spot and self.distance is not None and self.distance > 0.0

    @property
    def energy_per_radian(self) -> float | None:
        """Absolute energy per yaw of a robot that turns on the spot [J/rad]; None of others."""
        return self.absolute_energy / abs(self.turn) if self.on_the_spot and self.turn else None

    def _per_distance(self, energy: float) -> float | None:
        """Return an energy per weight and distance."""
        return None if self.on_the_spot else energy_per_way(energy, self.weight, self.distance)

    def joint(self, name: str) -> JointBudget:
        """Return the row of one joint.

        Raises:
            UnknownNameError: there is no such joint.
        """
        return named("joint", name, {row.joint: row for row in self.joints})

    def kind(self, name: str) -> KindBudget:
        """Return the row of one kind of joint: "coxa", "femur", "tibia", "held", "slide".

        Raises:
            UnknownNameError: there is no such kind.
        """
        return named("kind of joint", name, {row.kind: row for row in self.kinds})

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the most that each kind of joint must deliver."""
        return str(drawn("notebook_html", self))

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data; NaN and infinities as None."""
        derived = ("absolute_energy", "net_energy", "cost_of_transport", "energy_per_radian")
        plain = asdict(self) | {name: getattr(self, name) for name in derived}
        plain["cost_of_transport_positive"] = self.cost_of_transport_positive
        plain["caveat"] = PEAK_CAVEAT[self.peaks]
        finite: dict[str, Any] = without_non_finite(plain)
        return finite

    def to_json(self, **more: Any) -> str:
        """Return `to_dict` as JSON text, with `more` entries, such as a verdict on the peaks."""
        return json.dumps({**self.to_dict(), **more}, indent=2, allow_nan=False)

    def table(self) -> str:
        """Return the budget as a plain text table with units."""
        per = "window" if self.window.cycles is None else "cycle"
        parts = (
            _heading_lines(self),
            kind_lines(self.kinds, per),
            joint_lines(self.joints, per),
            _whole_lines(self, per),
            _note_lines(self),
        )
        return "\n\n".join("\n".join(part) for part in parts)


def energy_per_way(energy: float, weight: float, distance: float | None) -> float | None:
    """Return an energy [J] over weight [N] and distance [m]: a cost of transport; None without."""
    if distance is None or not distance > 0.0 or not weight > 0.0:
        return None
    return energy / (weight * distance)


def _heading_lines(budget: TorqueBudget) -> list[str]:
    """Return what the budget is of, and over which time."""
    window = budget.window
    span = f"{window.start:.4g} to {window.end:.4g} s{window.counted}"
    return [f"Torque budget of {budget.robot_name}", f"window: {span}", *budget.sources]


def _whole_lines(budget: TorqueBudget, per: str) -> list[str]:
    """Return energy, distance and cost of transport of the whole robot."""
    title = f"Whole robot, mechanical energy at the joints, per {per}"
    rows: list[tuple[str, float, str]] = [
        ("absolute (braking costs as much as driving)", budget.absolute_energy, "J"),
        ("positive only (braking costs nothing)", budget.positive_energy, "J"),
        ("net (braking gives everything back)", budget.net_energy, "J"),
    ]
    last = ""
    if budget.distance is None or budget.measured_speed is None:
        last = "no gait cycle: no distance, no cost of transport"
    elif budget.on_the_spot:
        rows += _turn_rows(budget)
        last = "turning on the spot: no distance, no cost of transport"
    else:
        nominal, speed = budget.nominal_speed, budget.measured_speed
        share = f", {100.0 * speed / nominal:.1f} % of the gait's {nominal:.4g}" if nominal else ""
        rows.append(("distance per cycle along the heading", budget.distance, "m"))
        rows.append(("mean speed", speed, f"m/s{share}"))
        costs = (budget.cost_of_transport, budget.cost_of_transport_positive)
        if costs[0] is None or costs[1] is None:
            last = "the robot does not move forward: no cost of transport"
        else:
            rows.append(("cost of transport, absolute energy / (m g d)", costs[0], ""))
            rows.append(("cost of transport, positive energy / (m g d)", costs[1], ""))
    return [title, *indented([*labelled(rows, least=44), *([last] if last else [])])]


def _turn_rows(budget: TorqueBudget) -> list[tuple[str, float, str]]:
    """Return yaw, and energy per yaw, of a robot that turns on the spot."""
    turn, nominal = math.degrees(budget.turn or 0.0), math.degrees(budget.nominal_turn)
    share = f"{100.0 * turn / nominal:.1f} % of the gait's {nominal:.4g}"
    rows = [("yaw per cycle", turn, f"deg, {share}")]
    if budget.energy_per_radian is not None:
        rows.append(("absolute energy per yaw", budget.energy_per_radian, "J/rad"))
    return rows


def _note_lines(budget: TorqueBudget) -> list[str]:
    """Return what to know before using the numbers."""
    lines = ["* reaches the effort limit."] if any(row.at_limit for row in budget.joints) else []
    if any(row.kind == "slide" for row in budget.joints):
        lines.append("slide: held joints that slide; N for N m and m/s for rad/s.")
    lines.append(PEAK_CAVEAT[budget.peaks])
    if budget.largest_outside is not None:
        joint, time, torque = budget.largest_outside
        outside = f"{joint} reaches {torque:.4g} N m at {time:.4g} s"
        lines.append(f"Outside the window {outside} (start-up or stop).")
    return lines + [f"assumed: {statement}" for statement in budget.assumed]

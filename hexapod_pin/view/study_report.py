"""Reports of comparisons, sweeps, grids, tuning and peak verdicts: header, figures, tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.results.comparison import Comparison, failures, notes, scene_table
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.peak_verdict import LEGEND, PeakVerdict, PeakVerdicts, Spread
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.results.schema import schema
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.walk_metrics import Outcome
from hexapod_pin.view.map_figures import (
    draw_gait_energy,
    draw_torque_curves,
    draw_torque_heat_map,
)
from hexapod_pin.view.report import (
    Block,
    Cell,
    Column,
    Drawing,
    Header,
    Heading,
    Items,
    Paragraph,
    Table,
    Verdict,
    report_bytes,
)
from hexapod_pin.view.selection_report import ENDINGS
from hexapod_pin.view.study_facts import base_facts, gait_text, scene_facts, tables
from hexapod_pin.view.study_figures import (
    PEAK,
    RMS,
    SweepNumbers,
    TunedParameters,
    draw_comparison,
    draw_peak_verdicts,
    draw_sweep,
    draw_tuning,
)

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

MOST_ROWS = 2000
"""Cases of a sweep that are listed; the others are in its dataset."""

Result = Comparison | TorqueMap | GaitEnergy | PeakVerdicts | TunedParameters | SweepNumbers


@checked
def write_study_report(
    found: Any, path: str | Path, *, date: str | None = None, command: str = ""
) -> Path:
    """Write the report of a study of many runs, wholly or not at all, and return its path.

    A page that needs no network and no other file, and prints as pages of A4: what was run, how
    many runs have numbers, figures, a sortable row for every metric, case or point, what is
    assumed. The same result gives the same bytes.

    Args:
        found: of `compare`, `run_sweep`, `torque_map`, `study.gait_energy`, `study.judge_peaks` or
            `tune`.
        path: ends in .html.
        date: printed as it is; None: none is printed.
        command: that makes the report again; printed as it is.

    Raises:
        ParameterError: it is none of these results.
        TraceFileError: another ending, or the file cannot be written.
        MissingPackageError: matplotlib is not installed.

    Example:
        >>> write_study_report(comparison, "comparison.html")  # doctest: +SKIP
    """
    if not isinstance(found, Result):
        allowed = (
            "a Comparison, a sweep's result, a TorqueMap, a GaitEnergy, PeakVerdicts or a "
            "TuningResult"
        )
        raise ParameterError("found", found, allowed)
    check_ending(path, ENDINGS)
    return write_atomically(path, report_bytes(tuple(study_blocks(found, date or "", command))))


def study_blocks(found: Result, date: str = "", command: str = "") -> Iterator[Block]:
    """Return the whole report."""
    if isinstance(found, Comparison):
        yield from _of_comparison(found, date, command)
    elif isinstance(found, TorqueMap | GaitEnergy):
        yield from _of_grid(found, date, command)
    elif isinstance(found, PeakVerdicts):
        yield from _of_peaks(found, date, command)
    elif isinstance(found, TunedParameters):
        yield from _of_tuning(found, date, command)
    else:
        yield from _of_sweep(found, date, command)


def _counted(good: int, count: int, what: str, texts: Sequence[str] = ()) -> Verdict:
    """Return how many of the runs have numbers."""
    level = "good" if good == count else "open" if good else "bad"
    return Verdict(f"{good} OF {count} {what}", tuple(texts), level)


def _assumed(statements: Sequence[str]) -> Iterator[Block]:
    if statements:
        yield Heading("Assumed, because no source gives it")
        yield Items(tuple(statements))


def _drawing(drawing: Drawing) -> Iterator[Block]:
    """Return a figure, or why it cannot be drawn."""
    try:
        drawing.make()
    except HexapodError as error:
        yield Paragraph(f"No figure: {error}", small=True)
    else:
        yield drawing


# Comparisons.


def _of_comparison(found: Comparison, date: str, command: str) -> Iterator[Block]:
    good = sum(run.outcome is Outcome.WALKED for run in found.runs)
    others = ", ".join(found.controllers[1:])
    against = f"{others} against {found.baseline}" if others else found.baseline
    robots, runs = [], []
    for line in found.settings:
        robot, _, rest = line.partition(", ")
        robots.append(robot)
        runs.append(rest)
    yield Header(
        f"Comparison: {against}",
        _counted(good, len(found.runs), "RUNS WALKED", failures(found)),
        robot="; ".join(dict.fromkeys(robots)), gait=", ".join(found.controllers),
        motor=found.motor, contact=found.contact,
        accuracy="; ".join(dict.fromkeys(runs)),
        more=(("Scenes", ", ".join(found.scenes)),), date=date, command=command,
    )  # fmt: skip
    if others:
        caption = "Change of each metric against the baseline, with its confidence interval."
        yield from _drawing(Drawing(partial(draw_comparison, found), caption))
    for scene in found.scenes:
        table = scene_table(found, scene)
        yield Heading(table.title)
        yield Table.of(table)
    for line in notes(found):
        if not line.startswith("assumed"):
            yield Paragraph(line, small=True)
    yield from _assumed(found.assumed)


# Sweeps.


def _of_sweep(found: SweepNumbers, date: str, command: str) -> Iterator[Block]:
    peaks = found.columns[PEAK].values if PEAK in found.columns else np.zeros((len(found), 0))
    known = np.isfinite(peaks).any(axis=1)
    about = found.attributes
    facts = base_facts(about.get("study", ""), [item["name"] for item in found.inputs])
    yield Header(
        f"Sweep: {found.name}", _counted(int(known.sum()), len(found), "CASES HAVE NUMBERS"),
        robot="; ".join(about.get("robots", "").split("\n")), **facts,
        more=(("Study", about.get("study_digest", "")),), date=date, command=command,
    )  # fmt: skip
    if known.any():
        yield from _drawing(
            Drawing(partial(draw_sweep, found), "Torques against what the study varies.")
        )
    yield Heading("Inputs")
    inputs = [
        (Cell(item["name"]), Cell(item["unit"]), Cell(item["meaning"]),
         Cell("all values" if item["grid"] else "drawn"))
        for item in found.inputs
    ]  # fmt: skip
    titles = (Column("Input", wide=True), Column("Unit"), Column("Meaning", wide=True))
    yield Table((*titles, Column("How")), tuple(inputs))
    yield Heading("Cases")
    yield _case_table(found)
    assumed = [line for line in about.get("assumed", "").split("\n") if line]
    yield from _assumed(assumed)


def _case_table(found: SweepNumbers) -> Table:
    """Return a row for each case: inputs, torques of each kind of joint, why it has none."""
    count = min(len(found), MOST_ROWS)
    names = [item["name"] for item in found.inputs]
    columns = [Column("Case"), *map(Column, names)]
    parts: list[list[Cell]] = [[Cell(str(k))] for k in range(count)]
    for name in names:
        values = found.input_values(name)
        for row, value in zip(parts, values[:count], strict=True):
            row.append(Cell(_text(value)))
    for name, word in ((PEAK, "peak"), (RMS, "RMS")):
        if name not in found.columns:
            continue
        column = found.columns[name]
        kinds = found.columns[column.dims[1]].values
        columns += [Column(f"{kind} {word} [N m]") for kind in kinds]
        for row, values in zip(parts, column.values[:count], strict=True):
            row += [Cell(_text(value)) for value in values]
    columns.append(Column("Why it has no numbers", wide=True))
    for row, reason in zip(parts, found.columns["reason"].values[:count], strict=True):
        row.append(Cell(str(reason)))
    rest = len(found) - count
    note = f"{rest} more cases are in the dataset of the sweep." if rest else ""
    return Table(tuple(columns), tuple(map(tuple, parts)), note=note)


def _text(value: object) -> str:
    """Return a number to four digits; "-" where it is not known."""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}" if math.isfinite(value) else "-"
    return str(value)


# Grids: torque maps and energies of gaits.


def _of_grid(found: TorqueMap | GaitEnergy, date: str, command: str) -> Iterator[Block]:
    run, reason = found.run, np.asarray(found.reason, dtype=object)
    walked = int(np.count_nonzero(reason == ""))
    title = "Torque map" if isinstance(found, TorqueMap) else "Energy of gaits"
    scene = run.scene or next(iter(run.scenes.values()), "")
    own = gait_text(tables(run.controller).get("gait"))
    gait = own or run.walk if isinstance(found, TorqueMap) else ", ".join(found.gaits)
    more = () if isinstance(found, TorqueMap) else (("Scenes", ", ".join(found.scenes)),)
    yield Header(
        f"{title}: {run.robot}", _counted(walked, reason.size, "POINTS WERE WALKED"),
        robot=run.robot, gait=gait, **scene_facts(tables(scene)),
        accuracy="" if run.accuracy is None else f"{run.accuracy:g} m or rad",
        more=more, date=date, command=command,
    )  # fmt: skip
    for drawing in _grid_figures(found):
        yield from _drawing(drawing)
    yield Heading("Points")
    yield _grid_table(found)
    yield from _assumed(run.assumed)


def _grid_figures(found: TorqueMap | GaitEnergy) -> tuple[Drawing, ...]:
    if isinstance(found, GaitEnergy):
        return (Drawing(partial(draw_gait_energy, found), "Costs against speed."),)
    return (
        Drawing(partial(draw_torque_heat_map, found), "Largest torque of each kind of joint."),
        Drawing(partial(draw_torque_curves, found), "Torques of the phases of a step."),
    )


def _grid_table(found: TorqueMap | GaitEnergy) -> Table:
    """Return a row for each point of the grid, with all its numbers; of joints those of kinds."""
    grid = found.GRID
    values: dict[str, Array] = {}
    for name, one in schema(type(found)).items():
        title = f"{name.replace('_', ' ')} [{one.unit}]"
        if one.axes == grid:
            values[title] = getattr(found, name)
        elif isinstance(found, TorqueMap) and one.axes == (*grid, "joint"):
            for kind in found.kind_names:
                values[f"{kind} {title}"] = found.of_kind(name, kind)
    labels, units = found.labels(), {name: one.unit for name, one in schema(type(found)).items()}
    columns = [
        Column(f"{axis.replace('_', ' ')} [{units[axis]}]" if axis in units else axis)
        for axis in grid
    ]
    columns += [*map(Column, values), Column("why it was not walked", wide=True)]
    reason = np.asarray(found.reason, dtype=object)
    rows = []
    for place in np.ndindex(reason.shape):
        at = (labels[axis][k] for axis, k in zip(grid, place, strict=True))
        numbers = (one[place] for one in values.values())
        rows.append(tuple(Cell(_text(x)) for x in (*at, *numbers, reason[place])))
    return Table(tuple(columns), tuple(rows))


# Peaks with their verdicts.


def _of_peaks(found: PeakVerdicts, date: str, command: str) -> Iterator[Block]:
    good = sum(row.holds for row in found.joints)
    window = found.window
    cycles = "" if window.cycles is None else f", {window.cycles} whole cycle(s)"
    yield Header(
        f"Peaks with a verdict: {found.robot_name}",
        _counted(good, len(found.joints), "PEAKS HOLD",
                 [f"{row.name}: {row.text}" for row in found.kinds]),
        robot=found.robot_name, accuracy="; ".join(found.sources),
        more=(("Window", f"{window.start:.4g} to {window.end:.4g} s{cycles}"),),
        date=date, command=command,
    )  # fmt: skip
    yield from _drawing(Drawing(partial(draw_peak_verdicts, found), "Peaks and their ranges."))
    yield Heading("Computed again with")
    changes = [
        (Cell(row.title), Cell("; ".join(filter(None, (row.unneeded or row.change, row.failure)))))
        for row in found.recomputations
    ]
    yield Table((Column("Change", wide=True), Column("What it was", wide=True)), tuple(changes))
    tried = [row.name for row in found.recomputations if not row.unneeded]
    for title, rows in (("Each kind", found.kinds), ("Every joint", found.joints)):
        yield Heading(title)
        yield _peak_table(rows, tried)
    yield Heading("Impulse of the normal force")
    feet = [
        (Cell(row.foot), Cell(_text(row.impulse.value)), Cell(_range(row.impulse)))
        for row in found.feet
    ]
    titles = (Column("Foot", wide=True), Column("Impulse [N s]"), Column("least to largest"))
    yield Table(titles, tuple(feet))
    for line in (*LEGEND, *found.notes):
        yield Paragraph(line, small=True)
    yield from _assumed(found.assumed)


def _peak_table(rows: Sequence[PeakVerdict], tried: Sequence[str]) -> Table:
    """Return a row for each peak; marked where it does not hold."""
    columns = ["Verdict", "Peak [N m]", "least to largest", *(f"{name} [%]" for name in tried)]
    columns += ["p99 [N m]", "RMS [N m]", "Limit [N m]"]
    cells = [
        (
            Cell(row.name), Cell(row.verdict, "" if row.holds else "bad"),
            Cell(_text(row.torque_peak.value)), Cell(_range(row.torque_peak)),
            *(Cell(f"{100.0 * row.changes[n]:+.1f}" if n in row.changes else "?") for n in tried),
            Cell(_text(row.torque_p99.value)), Cell(_text(row.torque_rms.value)),
            Cell(_text(row.effort_limit)),
        )
        for row in rows
    ]  # fmt: skip
    return Table((Column("", wide=True), *map(Column, columns)), tuple(cells))


def _range(spread: Spread) -> str:
    return f"{spread.low:.4g} to {spread.high:.4g}"


# Tuned parameters.


def _of_tuning(found: TunedParameters, date: str, command: str) -> Iterator[Block]:
    held = found.held_out
    gain = found.tuned.gain if held is None else held.gain
    where = "the scenes tuned on" if held is None else "scenes that it was not tuned on"
    level = "open" if held is None or math.isnan(gain) else "good" if gain > 0.0 else "bad"
    texts = [
        f"Tuned on: {_share(found.tuned.gain)} below the baseline's score.",
        "Held out: not run, tuning was interrupted." if held is None
        else f"Held out: {_share(held.gain)} below the baseline's score.",
    ]  # fmt: skip
    yield Header(
        f"Tuning: {', '.join(found.best)}",
        Verdict(f"{_share(gain)} BETTER ON {where.upper()}", tuple(texts), level),
        robot=found.robot, gait=found.walk,
        more=(("Scenes", ", ".join(found.tuned.by_scene)),
              ("Held out", "" if held is None else ", ".join(held.by_scene)),
              ("Search", f"{len(found.history)} candidates, {found.failed} failed (score "
                         f"{found.penalty:g}), seed {found.seed}")),
        date=date, command=command,
    )  # fmt: skip
    yield from _drawing(Drawing(partial(draw_tuning, found), "Scores of all candidates."))
    yield Heading("Parameters")
    rows = []
    for name, value in found.best.items():
        low, high = found.bounds[name]
        scale = "logarithmic" if name in found.logarithmic else "linear"
        numbers = (Cell(_text(x)) for x in (found.start[name], value, low, high))
        rows.append((Cell(name), *numbers, Cell(scale)))
    titles = ("Start", "Best", "Least allowed", "Largest allowed", "Scale")
    yield Table((Column("Parameter", wide=True), *map(Column, titles)), tuple(rows))
    yield Heading("Scores; less is better")
    yield _score_table(found)
    yield Heading("Candidates")
    tried = [
        (Cell(str(k)), Cell(str(one.generation)), Cell(_text(one.score)),
         *(Cell(_text(one.values[name])) for name in found.best), Cell(one.failure))
        for k, one in enumerate(found.history[:MOST_ROWS], start=1)
    ]  # fmt: skip
    names = ("Candidate", "Generation", "Score", *found.best)
    yield Table((*map(Column, names), Column("Why it failed", wide=True)), tuple(tried))


def _score_table(found: TunedParameters) -> Table:
    """Return a row for each set of scenes, and for each scene."""
    rows = []
    for label, scores in (("tuned on", found.tuned), ("held out", found.held_out)):
        if scores is None:
            continue
        all_of_them = {f"{label}: all": (scores.baseline, scores.start, scores.best)}
        each = {f"{label}: {name}": row for name, row in scores.by_scene.items()}
        for name, row in (all_of_them | each).items():
            gain = 1.0 - row[2] / row[0] if row[0] > 0.0 else math.nan
            rows.append((Cell(name), *(Cell(_text(x)) for x in row), Cell(_share(gain))))
    titles = ("Baseline", "Start", "Best", "Gain")
    return Table((Column("Scenes", wide=True), *map(Column, titles)), tuple(rows))


def _share(gain: float) -> str:
    return f"{100.0 * gain:.1f} %" if math.isfinite(gain) else "not known how much"

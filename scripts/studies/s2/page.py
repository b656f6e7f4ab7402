"""The page of S2's study in the documentation: its numbers are those of the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.peak_verdict import PeakVerdicts
from hexapod_pin.results.stability import stability
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import StudyPart
from hexapod_pin.text_table import Table
from studies.s2 import words
from studies.s2.claims import Claim, claims
from studies.s2.findings import contact_table, energy_claims, findings, output_table
from studies.s2.motors import motor_table
from studies.s2.runs import RAMPS

PAGE = "s2_study.md"

WALKS = {
    "paper": "velocity by STEPs, ramps of 10 % (*assumed*)",
    "ramp_25": "velocity by STEPs, ramps of 25 % (*assumed*)",
    "step": "angle by one STEP (another reading)",
    "constant": "constant rate in stance (another reading)",
    "straight": "straight lines (no scrub)",
    "paper_servo": "velocity by STEPs, default servos (*assumed*)",
}

ENVELOPE = {  # N m: femur peak, femur stance RMS, total moment at the coxa; statics, 1 % rounding
    "slow_tripod": (1.66, 1.17, 2.73),
    "slow_tetrapod": (1.31, 0.80, 2.16),
    "slow_wave_2_3": (1.19, 0.79, 1.95),
    "slow_wave_5_6": (0.93, 0.61, 1.50),
}
"""Least-squares shares of the weight on rigid legs, arcs of 0.14 m, computed elsewhere."""


def write_page(
    folder: Path, study: Mapping[str, StudyPart], verdicts: Mapping[str, PeakVerdicts]
) -> Path:
    """Write the page; `verdicts` are those on the peaks of `WALKS`."""
    grid, energy = study["torque_map"], study["gait_energy"]
    assert isinstance(grid, TorqueMap) and isinstance(energy, GaitEnergy)
    traces = {name: one for name, one in study.items() if isinstance(one, Trace)}
    parts = [
        words.HEAD, "## S2's statements", words.CLAIMS, claims_table(claims(study)).markdown(),
        "## Findings", words.FINDINGS, claims_table(findings(study), "finding").markdown(),
        "## Motion (figure 3)", words.MOTION, "## Centre of mass (figure 5)", words.MASS_CENTER,
        margins_table(traces).markdown(), "## Joint torques (figure 6)", words.TORQUES,
        torque_table(traces).markdown(), words.RAMPS, ramp_table(traces).markdown(),
        "### Which peaks hold", words.VERDICTS, verdict_table(verdicts).markdown(),
        "### What 600 output steps show", words.OUTPUT,
        output_table(traces, WALKS).markdown(), "### Motors", words.MOTORS,
        motor_table(traces["paper"]).markdown(), "### The quasi-static limit", words.SLOW,
        envelope_table(traces).markdown(), "## Stroke and cycle time", words.SWEEPS.format(
            peak=_error(grid, "torque_peak"), rms=_error(grid, "torque_rms")),
        "## Energy against speed", words.ENERGY, contact_table(energy).markdown(), words.FUTURE,
        claims_table(energy_claims(energy), "cost: drive, contact").markdown(),
        *_energy_tables(energy), "## More", words.MORE,
    ]  # fmt: skip
    page = folder / PAGE
    return write_atomically(page, "\n\n".join(part.strip() for part in parts) + "\n")


def claims_table(rows: Sequence[Claim], what: str = "S2 states") -> Table:
    """Return each statement or finding with our numbers and a verdict."""
    head = (what, "our numbers", "verdict", "why")
    return Table("", head, [(c.text, c.numbers, f"**{c.verdict}**", c.reason) for c in rows])


def margins_table(traces: Mapping[str, Trace]) -> Table:
    """Return least margins and the path of the centre of mass of each walk."""
    rows = []
    for name, text in WALKS.items():
        found = stability(traces[name])
        least = (found.least(k)[0] for k in ("static_margin", "nesm", "zmp_margin"))
        span = np.ptp(found.excursion, axis=0)
        rows.append((text, *(f"{1e3 * x:.1f}" for x in (*least, *span))))
    head = ("walk", "static margin", "NESM", "ZMP margin", "along", "sideways", "height")
    return Table("", head, rows)


def torque_table(traces: Mapping[str, Trace]) -> Table:
    """Return axis torques by kind of joint and total moments of each walk."""
    rows = []
    for name, text in WALKS.items():
        kinds = torque_budget(traces[name]).kinds
        cells = [f"{k.peak.torque_peak:.2f} / {k.p99.torque_p99:.2f} / {k.rms.torque_rms:.3f}"
                 for k in kinds]  # fmt: skip
        moment = joint_moments(traces[name]).moment
        peaks = [f"{moment[:, j::3].max():.2f}" for j in range(3)]
        rows.append((text, *cells, " / ".join(peaks)))
    head = ("walk", "coxa: peak / p99 / RMS", "femur", "tibia", "total moments, joints 1 / 2 / 3")
    return Table("", head, rows)


def ramp_table(traces: Mapping[str, Trace]) -> Table:
    """Return the peaks of S2's motion by the share of its ramps."""
    rows = [
        (f"{share:.0%}", *(f"{k.peak.torque_peak:.3f}" for k in torque_budget(traces[name]).kinds))
        for name, share in RAMPS.items()
    ]
    return Table("", ("ramp", "coxa", "femur", "tibia"), rows)


def verdict_table(verdicts: Mapping[str, PeakVerdicts]) -> Table:
    """Return the verdict on the peaks of each kind of joint, and the spread of the impulses."""
    rows = []
    for name, found in verdicts.items():
        impulse = max(
            (one.impulse.high - one.impulse.low) / one.impulse.value for one in found.feet
        )  # fmt: skip
        cells = [kind.text for kind in found.kinds]
        rows.append((WALKS[name], *cells, f"{impulse:.1%}"))
    return Table("", ("walk", "coxa", "femur", "tibia", "spread of foot impulses"), rows)


def envelope_table(traces: Mapping[str, Trace]) -> Table:
    """Return the quasi-static torques beside statics, with their differences."""
    rows = []
    for name, expected in ENVELOPE.items():
        trace = traces[name]
        budget = torque_budget(trace)
        cycle = budget.window.samples
        femur, down = trace.torque[cycle, 1::3], trace.normal_force[cycle] > 0.0
        found = (
            budget.kind("femur").peak.torque_peak,
            float(np.sqrt(np.mean(femur[down] ** 2))),
            float(joint_moments(trace).moment[:, 0::3].max()),
        )
        cells = [f"{ours:.3f} / {theirs:.2f} ({ours / theirs - 1.0:+.1%})"
                 for ours, theirs in zip(found, expected, strict=True)]  # fmt: skip
        rows.append((name.removeprefix("slow_").replace("_", " ", 1).replace("_", "/"), *cells))
    head = ("gait", "femur peak: ours / statics", "femur RMS in stance", "total moment at joint 1")
    return Table("", head, rows)


def _energy_tables(energy: GaitEnergy) -> list[str]:
    costs = ("cost_of_transport_positive", "cost_of_transport_electrical", "torque_index")
    return [f"```\n{energy.table(cost, scene)}\n```" for scene in energy.scenes for cost in costs]


def _error(grid: TorqueMap, quantity: str) -> str:
    return "not checked" if grid.check is None else f"{grid.check.error(quantity):.2%}"
